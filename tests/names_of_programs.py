"""What programs and data sets call the joints of a body: for tests, and apart from the code's own.

Each entry gives the trunk from the hips to the head, and the limbs of the left and the right side,
by role (see `made_bodies`).
"""

from __future__ import annotations

ROLES = ("collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
TRUNK = ("hips", "spine", "spine2", "chest", "neck", "head")

_PROGRAMS = {
    "Mixamo": (
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck "
        "mixamorig:Head",
        "mixamorig:{Left|Right}",
        "Shoulder Arm ForeArm Hand UpLeg Leg Foot ToeBase",
    ),
    "Rokoko": (
        "Hips Spine1 Spine2 Spine3 Neck Head",
        "{Left|Right}",
        "Shoulder Arm ForeArm Hand Thigh Shin Foot Toe",
    ),
    "Xsens": (
        "Hips Chest Chest2 Chest3 Neck Head",
        "{Left|Right}",
        "Collar Shoulder Elbow Wrist Hip Knee Ankle Toe",
    ),
    "Xsens MVN": (
        "Pelvis L5 L3 T12 Neck Head",
        "{Left|Right}",
        "Shoulder UpperArm Forearm Hand UpperLeg LowerLeg Foot Toe",
    ),
    "OptiTrack": (
        "Hip Ab Ab2 Chest Neck Head",
        "{L|R}",
        "Shoulder UArm FArm Hand Thigh Shin Foot Toe",
    ),
    "Vicon": (
        "root lowerback upperback thorax neck head",
        "{l|r}",
        "clavicle humerus radius hand femur tibia foot toes",
    ),
    "3ds Max Biped": (
        "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Spine2 Bip01_Neck Bip01_Head",
        "Bip01_{L|R}_",
        "Clavicle UpperArm Forearm Hand Thigh Calf Foot Toe0",
    ),
    "3ds Max Biped, spaces": (
        "Bip001 Pelvis,Bip001 Spine,Bip001 Spine1,Bip001 Spine2,Bip001 Neck,Bip001 Head",
        "Bip001 {L|R} ",
        "Clavicle UpperArm Forearm Hand Thigh Calf Foot Toe0",
    ),
    "Rigify": (
        "DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003 DEF-neck DEF-head",
        "DEF-*.{L|R}",
        "shoulder upper_arm forearm hand thigh shin foot toe",
    ),
    "Unreal": (
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "*_{l|r}",
        "clavicle upperarm lowerarm hand thigh calf foot ball",
    ),
    "Unity": (
        "Hips Spine Chest UpperChest Neck Head",
        "{Left|Right}",
        "Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot Toes",
    ),
    "VRM": (
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
        "J_Bip_{L|R}_",
        "Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot ToeBase",
    ),
    "SMPL": (
        "Pelvis Spine1 Spine2 Spine3 Neck Head",
        "{L|R}_",
        "Collar Shoulder Elbow Wrist Hip Knee Ankle Foot",
    ),
    "SMPL-X": (
        "pelvis spine1 spine2 spine3 neck head",
        "{left|right}_",
        "collar shoulder elbow wrist hip knee ankle foot",
    ),
    "Kinect": (
        "PELVIS SPINE_NAVEL SPINE_MIDDLE SPINE_CHEST NECK HEAD",
        "*_{LEFT|RIGHT}",
        "CLAVICLE SHOULDER ELBOW WRIST HIP KNEE ANKLE FOOT",
    ),
    "Human3.6M": (
        "Hips LowerBack Spine Spine1 Neck Head",
        "{Left|Right}",
        "Shoulder Arm ForeArm Hand UpLeg Leg Foot ToeBase",
    ),
    "Bandai": (
        "Hips Spine Spine2 Chest Neck Head",
        "*_{L|R}",
        "Shoulder UpperArm LowerArm Hand UpperLeg LowerLeg Foot Toes",
    ),
    "Poser": (
        "hip abdomen abdomen2 chest neck head",
        "{l|r}",
        "Collar Shldr ForeArm Hand Thigh Shin Foot Toe",
    ),
    "Daz": (
        "hip abdomenLower abdomenUpper chestUpper neckLower head",
        "{l|r}",
        "Collar ShldrBend ForearmBend Hand ThighBend Shin Foot Toe",
    ),
    "MakeHuman": (
        "Root Spine1 Spine2 Spine3 Neck Head",
        "*_{L|R}",
        "Clavicle UpArm LoArm Hand UpLeg LoLeg Foot Toe",
    ),
    "MakeHuman, default rig": (
        "root spine05 spine03 spine01 neck01 head",
        "*.{L|R}",
        "clavicle upperarm01 lowerarm01 wrist upperleg01 lowerleg01 foot toe1-1",
    ),
    "Second Life": (
        "mPelvis mTorso mSpine3 mChest mNeck mHead",
        "m*{Left|Right}",
        "Collar Shoulder Elbow Wrist Hip Knee Ankle Foot",
    ),
    "MotionBuilder": (
        "Character1_Hips Character1_Spine Character1_Spine1 Character1_Spine2 Character1_Neck "
        "Character1_Head",
        "Character1_{Left|Right}",
        "Shoulder Arm ForeArm Hand UpLeg Leg Foot ToeBase",
    ),
    "shouted": (
        "HIPS SPINE SPINE1 CHEST NECK HEAD",
        "{LEFT|RIGHT}",
        "COLLAR SHOULDER ELBOW WRIST HIP KNEE ANKLE TOE",
    ),
    "whispered": (
        "hips spine spine1 spine2 neck head",
        "{left|right}",
        "shoulder arm forearm hand upleg leg foot toebase",
    ),
}


def _tables() -> dict[str, dict[str, str]]:
    tables = {}
    for program, (trunk, pattern, limbs) in _PROGRAMS.items():
        words = trunk.split(",") if "," in trunk else trunk.split()
        table = dict(zip(TRUNK, words, strict=True))
        before, _, rest = pattern.partition("{")
        sides, _, after = rest.partition("}")
        for side, said in zip(("left", "right"), sides.split("|"), strict=True):
            for role, limb in zip(ROLES, limbs.split(), strict=True):
                spelt = f"{before}{said}{after}"
                name = spelt.replace("*", limb) if "*" in pattern else spelt + limb
                table[f"{side}_{role}"] = name
        tables[program] = table
    return tables


NAMES = _tables()
"""For each program the name of each role."""
