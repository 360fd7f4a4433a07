"""A folder with every file and library that the documentation names, so that its commands run."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from fake_blender import make_blender, scene
from small_library import build, run
from smpl_arrays import arrays, body_model

from mocapdb.compression import Target
from mocapdb.corpus import synthetic
from mocapdb.io import write_clip
from mocapdb.library import BuildSettings
from mocapdb.motion.clip import Clip

# joints as MotionBuilder and its kin call them: the pages name some of them
OTHERWISE = {
    "root": "Hips", "lowerneck": "Neck", "head": "Head", "lhand": "LeftHand", "rhand": "RightHand",
    "lhumerus": "LeftArm", "rhumerus": "RightArm", "lfemur": "LeftUpLeg", "rfemur": "RightUpLeg",
    "lthumb": "LeftHandThumb1", "lfingers": "LeftHandIndex1",
}  # fmt: skip
FILES = {
    "take.bvh": "walk", "clean.bvh": "walk", "walk.bvh": "walk", "run.bvh": "run",
    "take.amc": "walk", "clip.amc": "walk", "07_01.amc": "walk", "13_29.amc": "sequence",
    "run_normal_001.bvh": "run", "dance.bvh": "wave",
}  # fmt: skip
CORPUS = {"07_01": "walk", "35_17": "walk", "02_03": "run", "13_29": "squat"}
LIBRARIES = ("cmu.mocapdb", "styles.mocapdb", "takes.mocapdb", "LIB", "demo/demo.mocapdb")
FPS = 30.0
QUICK = BuildSettings(
    Target("mean_mm", 3.0, joint_share=0), {"transform": "dct", "decorrelation": "none"}
)


def _clip(kind: str, seed: int, seconds: float = 5.0) -> Clip:
    clip = synthetic.make_clip(kind, seed=seed, duration_s=seconds, fps=FPS)
    return clip.rename_joints(OTHERWISE)


def make_desk(folder: Path) -> Path:
    """Fill a folder."""
    for number, (name, kind) in enumerate(FILES.items()):
        write_clip(_clip(kind, seed=number), folder / name)
    for name in ("walk_poses.npz", "amass_poses.npz"):
        np.savez(folder / name, **arrays())
    body_model(folder / "SMPLH_FEMALE.npz")
    make_blender(folder)
    scene(folder / "take.fbx", "takes")
    corpus = folder / "corpus"
    corpus.mkdir()
    rows = ["clip,label,style,take"]
    for number, (name, label) in enumerate(CORPUS.items(), start=1):
        write_clip(_clip(label, seed=20 + number, seconds=2.5), corpus / f"{name}.bvh")
        rows.append(f"{name},{label},{'old' if number % 2 else 'young'},{number}")
    (corpus / "LABELS.csv").write_text("\n".join(rows) + "\n")
    build(corpus, folder / "studio.mocapdb", QUICK, index=True)
    for name in ("hops", "jumps", "walks"):
        library, walk = folder / "studio.mocapdb", folder / "walk.bvh"
        asked = run("query", library, walk, "--to", 1, "--save", name)
        assert asked.exit_code == 0, asked.output
    for name in LIBRARIES:
        shutil.copytree(folder / "studio.mocapdb", folder / name)
    for name in ("FOLDER", "folder", "cmu/02"):
        (folder / name).mkdir(parents=True)
        shutil.copy(corpus / "02_03.bvh", folder / name / "02_01.bvh")
    for name in ("walks", "takes"):
        (folder / name).mkdir()
        write_clip(_clip("walk", seed=30), folder / name / "dataset-1_walk-left_old_001.bvh")
    return folder
