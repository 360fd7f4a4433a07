"""Understanding a body: what a skeleton's joints are, which way is up, and how long a unit is.

===================  ========================================================================
`understanding`      `understand`: the one place that decides, which all others ask
`findings`           what was found, with evidence and a confidence; what the user gives
`canonical_joints`   the joints that a human body is understood by, and a human's proportions
`joint_names`        what a joint's name says, in the spellings of many programs
`named_joints`       finding joints by their names
`shaped_joints`      finding joints by the shape of limbs that mirror each other
`given_joints`       what the user gives, checked
`head`               finding the head by its shape
`sides`              which side is left
`body_sides`         on which side each joint is
`trunk`              hips, spine, chest and toes, from the limbs
`anatomy`            whether what was found is a human body; its stature
`unit_and_up`        the unit of length and the vertical axis
`position_channels`  whether position channels are places or displacements
`segments`           anatomical frames of segments, in which two bodies can be compared
`body_and_scene`     parting a body from the joints above it that carry only the scene
`pose_tree`          a skeleton as a tree of bones' starts, posed over some frames
===================  ========================================================================
"""

from mocapdb.motion.body.body_and_scene import Scene, part_from_scene
from mocapdb.motion.body.body_sides import joint_sides
from mocapdb.motion.body.canonical_joints import JOINTS
from mocapdb.motion.body.findings import Body, Finding, Given
from mocapdb.motion.body.understanding import understand, understand_pose

__all__ = [
    "JOINTS",
    "Body",
    "Finding",
    "Given",
    "Scene",
    "joint_sides",
    "part_from_scene",
    "understand",
    "understand_pose",
]
