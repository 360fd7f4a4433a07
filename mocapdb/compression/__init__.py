"""Compression: a clip as few bytes as a target error allows.

``encode``, ``decode``   the interface to every codec
``PayloadReader``        an open payload, for frames here and there
``Target``               what may be lost: skinned error, mean or maximum distance of points
``ByteBudget``           or how many bytes a frame it may take, at the least error
``Payload``              the bytes, and what they lost
``Basis``, ``SetBasis``  what the clips of a class share: of the pose codec, and of O'Kane's
``Budgets``              how the stages of O'Kane's codec divide the target

=============  ===============================================================================
`codec`        the interface to every codec, and ``raw``, which keeps the channels as they are
`targets`      what a clip may lose, or take
`tightening`   a target is held by what is decoded, or a tighter one is tried
`byte_search`  the least error within a number of bytes
`pose`         the pose codec, the default: splines in the metric of the skin
`okane`        O'Kane's codec: PCA, a transform over time, the largest coefficients
`transforms`   the DCT and the wavelet that both use
`payload`      the byte format that they share; docs/format.md specifies all of it
`tuning`       every tuned number of the codecs
=============  ===============================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.compression.codec import PayloadReader as PayloadReader
    from mocapdb.compression.codec import decode as decode
    from mocapdb.compression.codec import encode as encode
    from mocapdb.compression.okane.okane_codec import Budgets as Budgets
    from mocapdb.compression.okane.okane_search import OKANE_REPRESENTATION as OKANE_REPRESENTATION
    from mocapdb.compression.okane.set_basis import SetBasis as SetBasis
    from mocapdb.compression.okane.set_basis import fit_set_basis as fit_set_basis
    from mocapdb.compression.payload import Payload as Payload
    from mocapdb.compression.pose.class_basis import Basis as Basis
    from mocapdb.compression.pose.class_basis import fit_basis as fit_basis
    from mocapdb.compression.targets import ByteBudget as ByteBudget
    from mocapdb.compression.targets import Target as Target

__getattr__, __dir__, __all__ = attach(__name__)
