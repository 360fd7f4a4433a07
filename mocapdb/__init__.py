"""mocapdb turns a folder of motion-capture files into a compressed, searchable library.

The jobs, with the shortest way to each:

==========  =======================================================================================
read        ``clip = mocapdb.read_clip("take.bvh")``: AMC with ASF, BVH, NPZ, AMASS, glTF; by way
            of Blender FBX, Collada (.dae) and USD
look        ``clip.positions()``, ``.rotations()``, ``.velocities()``, ``.contacts()``,
            ``.to_dataframe()``, ``.plot()``
edit        ``clip.cut(1.0, 4.5).resample(30).mirror()``; also ``retime``, ``concat``, ``place``,
            ``in_place``, ``with_root``, ``drop_joints``, ``rename_joints``
write       ``mocapdb.write_clip(clip, "take.npz")``: BVH, AMC with ASF, NPZ, CSV, .glb, FBX (by
            Blender); in motion .gif, .mp4, .html
build       ``mocapdb.build_library("folder", "studio.mocapdb", mocapdb.BuildSettings(target))``
open        ``library = mocapdb.Library("studio.mocapdb")``, ``library.clip("07_01")``
query       ``mocapdb.query(library, clip)`` or ``library.query("07_01")``: motion like that
classify    ``mocapdb.classify(library, clip)``: what a clip is
clean       ``mocapdb.clean(clip).clip``: faults found, explained, repaired
fill        ``mocapdb.fill(clip, known, context)``: a whole body from a few joints
cycle       ``mocapdb.cycle(clip).cycle``: a clean lap; loops and blends: `cycles`
train       ``library.windows(length=64, fps=30)``: windows of motion as a dataset
gait        ``mocapdb.gait.analyse_gait(clip)``: strikes, strides, joint angles
segment     ``mocapdb.segment(clip)``: a long take cut into motions
==========  =======================================================================================

Where they are done:

==============  ==============================================================================
`jobs`          the functions above that are verbs
`motion`        skeletons, clips, kinematics, edits, representations, skin
`io`            ASF/AMC, BVH, NPZ, AMASS, glTF, CSV and FBX files
`corpus`        the CMU manifest, downloads, labels, and synthetic motion with known truth
`compression`   codecs that keep an error you name
`indexing`      classes of motion, and search by example
`cleaning`      faults of a capture: found, explained, repaired
`cycles`        from a clip, or a class, to a clean loop
`gait`          foot strikes, strides and joint angles
`segmentation`  a long take cut into motions
`library`       libraries on disk: build, open, decode, export, verify
`plots`         every still picture, one function each
`scenes`        clips in motion: GIF, MP4, a page that plays them
`report`        a library on one page
`viewer`        a library in a browser
`reproduce`     the papers' tables beside ours
`cli`           the ``mocapdb`` command
`errors`        every error that is raised on purpose
`base`          what all of it stands on: arrays, files, kernels, names that load on first use
==============  ==============================================================================

Names load on first use, so that the import is quick.

Examples
--------
>>> import mocapdb
>>> from mocapdb.corpus import synthetic
>>> walk = synthetic.make_clip("walk", seed=1, duration_s=2.0)
>>> _ = mocapdb.write_clip(walk, "walk.bvh")
>>> clip = mocapdb.read_clip("walk.bvh")
>>> len(clip), clip.fps, clip.skeleton.up
(240, 120.0, 'y')
>>> clip.resample(30).positions(units="m").shape  # frames, joints, xyz
(60, 38, 3)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb import cleaning as cleaning
    from mocapdb import compression as compression
    from mocapdb import corpus as corpus
    from mocapdb import cycles as cycles
    from mocapdb import gait as gait
    from mocapdb import indexing as indexing
    from mocapdb import io as io
    from mocapdb import library as library
    from mocapdb import motion as motion
    from mocapdb import plots as plots
    from mocapdb import scenes as scenes
    from mocapdb import segmentation as segmentation
    from mocapdb.compression import Target as Target
    from mocapdb.errors import MocapdbError as MocapdbError
    from mocapdb.io import read_clip as read_clip
    from mocapdb.jobs import classify as classify
    from mocapdb.jobs import clean as clean
    from mocapdb.jobs import cycle as cycle
    from mocapdb.jobs import fill as fill
    from mocapdb.jobs import query as query
    from mocapdb.jobs import segment as segment
    from mocapdb.jobs import write_clip as write_clip
    from mocapdb.library import BuildSettings as BuildSettings
    from mocapdb.library import Library as Library
    from mocapdb.library import build_library as build_library
    from mocapdb.motion.clip import Clip as Clip
    from mocapdb.motion.skeleton import Skeleton as Skeleton

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = attach(__name__)
__all__ += ["__version__"]
