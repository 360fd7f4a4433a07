"""Compression: a clip as few bytes as a target error allows.

``encode``, ``decode``   the interface to every codec
``PayloadReader``        an open payload, for frames here and there
``Target``               what may be lost: skinned error, mean or maximum distance of points
``Payload``              the bytes, and what they lost
``Basis``                directions that the clips of a class share
``Budgets``              how the stages of O'Kane's codec divide the target

The codecs: `pose_codec` (splines in the metric of the skin, the default), `okane` (PCA and a
transform over time, largest coefficients), and ``raw``, which keeps the channels as they are.
`payload` is the byte format; docs/format.md specifies all of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.compression.basis import Basis, fit_basis
    from mocapdb.compression.codec import DEFAULT_SHARES, PayloadReader, decode, encode
    from mocapdb.compression.okane import Budgets
    from mocapdb.compression.payload import Payload
    from mocapdb.compression.targets import Target

__all__ = [
    "DEFAULT_SHARES",
    "Basis",
    "Budgets",
    "Payload",
    "PayloadReader",
    "Target",
    "decode",
    "encode",
    "fit_basis",
]

_HOMES = {
    "DEFAULT_SHARES": "codec",
    "Basis": "basis",
    "Budgets": "okane",
    "Payload": "payload",
    "PayloadReader": "codec",
    "Target": "targets",
    "decode": "codec",
    "encode": "codec",
    "fit_basis": "basis",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
