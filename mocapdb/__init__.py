"""mocapdb turns a folder of motion-capture files into a compressed, searchable library.

==============  ==============================================================================
`motion`        skeletons, clips, kinematics, representations, skin
`io`            ASF/AMC, BVH and NPZ files
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

The names most programs need are here; they load on first use, so that the import is quick.

Examples
--------
>>> import mocapdb
>>> from mocapdb.corpus import synthetic
>>> walk = synthetic.make_clip("walk", seed=1, duration_s=2.0)
>>> _ = mocapdb.write_clip(walk, "walk.bvh")
>>> clip = mocapdb.read_clip("walk.bvh")
>>> len(clip), clip.fps, clip.skeleton.up
(240, 120.0, 'y')
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.compression import Target as Target
    from mocapdb.errors import MocapdbError as MocapdbError
    from mocapdb.io import read_clip as read_clip
    from mocapdb.io import write_clip as write_clip
    from mocapdb.library import BuildSettings as BuildSettings
    from mocapdb.library import Library as Library
    from mocapdb.library import build_library as build_library
    from mocapdb.motion.clip import Clip as Clip
    from mocapdb.motion.skeleton import Skeleton as Skeleton

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = attach(__name__)
__all__ += ["__version__"]
