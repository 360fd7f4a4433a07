"""One spelling of numba's decorator for every kernel in mocapdb."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def jit(kernel: Kernel) -> Kernel:
    """Compile a kernel on first use and keep the machine code for the next process.

    Division by zero gives inf or nan as in numpy, and the interpreter's lock is released.
    """
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")(kernel)
    return cast(Kernel, compiled)


def jit_sums(kernel: Kernel) -> Kernel:
    """As `jit`, but sums are taken in any order: only so do they become vector instructions."""
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"})(
        kernel
    )
    return cast(Kernel, compiled)
