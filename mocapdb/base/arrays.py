"""Names for the array types that the signatures use."""

from __future__ import annotations

from os import PathLike
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
Float32Array: TypeAlias = NDArray[np.float32]
IntArray: TypeAlias = NDArray[np.int64]
Int32Array: TypeAlias = NDArray[np.int32]
BoolArray: TypeAlias = NDArray[np.bool_]
ByteArray: TypeAlias = NDArray[np.uint8]
StrPath: TypeAlias = str | PathLike[str]


class FrameSource(Protocol):
    """Channels (F, C), or what computes those of a slice when it is asked for them."""

    def __getitem__(self, frames: slice, /) -> FloatArray: ...
