"""The phase of every frame: from a cloud of poses over a circle to time.

======================  ========================================================================
`circular_coordinates`  The loop of a motion by cohomology: circular coordinates of every frame,
`cohomology`            Circular coordinates by persistent cohomology
`excitation`            Where each of several motions in one clip happens, by circular
`laps`                  From coordinates on a circle to time: unwrapping, laps, and three
`pose_cloud`            Clouds of poses: what of a clip is looked at when its period is searched
`timing`                The phase of every frame of a clip: steady time, drifting time, or time
======================  ========================================================================
"""
