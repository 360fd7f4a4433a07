"""The Acclaim pair of files: a skeleton (ASF) and its motions (AMC).

The format has Y up, and its unit of length in metres is 0.0254 divided by the ``length`` of the
ASF's ``:units``. Bones turn about their own ``axis``: see `mocapdb.motion.skeleton.Skeleton`.
"""

from __future__ import annotations

from mocapdb.io.amc import DEFAULT_FPS, read_amc, write_amc
from mocapdb.io.asf import read_asf, write_asf

__all__ = ["DEFAULT_FPS", "read_amc", "read_asf", "write_amc", "write_asf"]
