"""The nouns: skeletons, clips, how joints move, representations, and the skin that measures loss.

============================  ====================================================================
`skeleton.Skeleton`           joints, hierarchy, rest offsets, degrees of freedom
`clip.Clip`                   a skeleton's channels over time
`kinematics`                  channels to world positions and rotations, and back
`rotations`                   matrices from Euler angles, continuous Euler angles from matrices
`heading`                     a yaw that stays continuous upside down
`representations`             channels, positions, aligned, scaled, normalised, with inverses
`contacts`                    legs by hierarchy, feet at rest, how far they slide
`ik`                          resting feet held in place
`skin`                        the faux mesh: skinned error, vertex and shell distances
============================  ====================================================================
"""
