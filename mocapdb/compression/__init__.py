"""Compression: a clip as few bytes as a target error allows.

``encode``, ``decode``   the interface to every codec
``Target``               what may be lost: skinned error, mean or maximum vertex distance
``Payload``              the bytes, and what they lost
``Budgets``              how the stages of a codec divide the target

The codecs: `okane` (PCA and a transform over time, largest coefficients), and ``raw``, which keeps
the channels as they are. `payload` is the byte format.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mocapdb.compression.codec import DEFAULT_SHARES, decode, encode
    from mocapdb.compression.okane import Budgets
    from mocapdb.compression.payload import Payload
    from mocapdb.compression.targets import Target

__all__ = ["DEFAULT_SHARES", "Budgets", "Payload", "Target", "decode", "encode"]

_HOMES = {
    "DEFAULT_SHARES": "codec",
    "Budgets": "okane",
    "Payload": "payload",
    "Target": "targets",
    "decode": "codec",
    "encode": "codec",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
