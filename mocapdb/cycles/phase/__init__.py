"""The phase of every frame: from poses to coordinates on a circle, and from these to time.

======================  =========================================================================
`pose_cloud`            what of a pose is looked at: positions, angles, rotations, delays
`cohomology`            circular coordinates by persistent cohomology
`circular_coordinates`  the same for a clip whose period is roughly known, and how clear they are
`laps`                  unwrapping, counting laps, evening out speed
`timing`                steady or drifting time, or time told by the coordinates
`stop_and_go`           motion with rests in it, whose laps coordinates tell
`centroid_curve`        a typical lap straight from circular coordinates
`excitation`            where each of several motions in one clip happens
======================  =========================================================================
"""
