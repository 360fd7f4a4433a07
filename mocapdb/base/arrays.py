"""Names for the array types that the signatures use."""

from __future__ import annotations

from numbers import Real
from os import PathLike
from typing import Any, Protocol, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
Float32Array: TypeAlias = NDArray[np.float32]
IntArray: TypeAlias = NDArray[np.int64]
Int32Array: TypeAlias = NDArray[np.int32]
BoolArray: TypeAlias = NDArray[np.bool_]
ByteArray: TypeAlias = NDArray[np.uint8]
StrPath: TypeAlias = str | PathLike[str]


def is_number(value: Any) -> TypeGuard[float]:
    """Tell whether a value is one real number; a truth value is none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def quantile_of(values: FloatArray, share: float) -> float:
    """Return a quantile of a few values (n,), as `numpy.quantile` does, at a tenth of its cost."""
    place = share * (len(values) - 1)
    low = int(place)
    least = np.partition(values, [low, min(low + 1, len(values) - 1)])
    return float(least[low] + (place - low) * (least[min(low + 1, len(values) - 1)] - least[low]))


class FrameSource(Protocol):
    """Channels (F, C), or what computes those of a slice when it is asked for them."""

    def __getitem__(self, frames: slice, /) -> FloatArray: ...
