"""Understanding a body: what a skeleton's joints are, which way is up, and how long a unit is.

===================  =================================================================
"""

from mocapdb.motion.body.canonical_joints import JOINTS
from mocapdb.motion.body.findings import Body, Finding, Given
from mocapdb.motion.body.understanding import understand, understand_pose

__all__ = ["JOINTS", "Body", "Finding", "Given", "understand", "understand_pose"]
