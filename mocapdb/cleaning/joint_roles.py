"""What a joint is: a toe or a thumb is restless, and says less, than a knee.

=========  =====================================================================================
`trunk`    pelvis, spine, neck, head, collars, and all joints of a body that is none of a human
`arm`      shoulder, elbow and wrist
`leg`      hip, knee and ankle
`hand`     below the wrist
`toe`      below the ankle
=========  =====================================================================================
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from mocapdb.motion.body import understand
from mocapdb.motion.clip import Clip

__all__ = ["BODY_ROLES", "ROLES", "Role", "joint_roles"]

Role: TypeAlias = Literal["trunk", "arm", "leg", "hand", "toe"]
ROLES: tuple[Role, ...] = ("trunk", "arm", "leg", "hand", "toe")
BODY_ROLES: tuple[Role, ...] = ("trunk", "arm", "leg")
"""Those that are no hands and no toes."""


def joint_roles(clip: Clip) -> tuple[Role, ...]:
    """Return what each joint of a clip's skeleton is."""
    skeleton = clip.skeleton
    turns = understand(skeleton, clip.channels).turns
    starts: dict[int, Role] = {}
    for name, joint in turns.items():
        part = name.split("_")[-1]
        if part in ("shoulder", "elbow", "wrist"):
            starts[joint] = "arm"
        elif part in ("hip", "knee", "ankle"):
            starts[joint] = "leg"
        elif part == "toe":
            starts[joint] = "toe"
    ends = {joint for name, joint in turns.items() if name.endswith(("wrist", "ankle"))}
    roles: list[Role] = []
    for joint, parent in enumerate(skeleton.parents.tolist()):
        above: Role = roles[parent] if parent >= 0 else "trunk"
        if parent in ends:
            above = "hand" if above == "arm" else "toe"
        roles.append(above if above in ("hand", "toe") else starts.get(joint, above))
    return tuple(roles)
