"""Skeletons and clips, how joints move, representations, and the skin that measures loss.

=================  =================================================================
`skeleton`         `Skeleton`: joints, hierarchy, rest offsets, degrees of freedom
`clip`             `Clip`: a skeleton's channels over time
`frame_range`      `FrameRange`: frames from a start to an end
`joint_tracks`     positions, rotations, velocities in the units and axes asked for
`edits`            other frames, another place, the other side
`joint_edits`      joints left out, named anew, one made the root
`clip_tables`      a motion as a table, tidy or wide
`kinematics`       channels to world positions and rotations, and back
`rotations`        matrices from Euler angles, continuous Euler angles from matrices
`quaternions`      unit quaternions of whole clips
`heading`          a yaw that stays continuous upside down
`representations`  channels, positions, aligned, scaled, normalised, with inverses
`foot_contacts`    legs by hierarchy, feet at rest, how far they slide
`body`             what a skeleton's joints are, which way is up, how long a unit is
`ik`               limbs that reach for a place: resting feet held, any joint moved
`skin`             the faux mesh: skinned error, vertex and shell distances
`joint_errors`     how far each joint turns by itself, and how much of that is lost
`tuning`           the tuned numbers
=================  =================================================================
"""
