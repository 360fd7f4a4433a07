"""One spelling of numba's decorator for every kernel in mocapdb."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import types

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def jit(kernel: Kernel) -> Kernel:
    """Compile a kernel on first use and keep the machine code for the next process.

    Division by zero gives inf or nan as in numpy, and the interpreter's lock is released.
    """
    return cast(Kernel, _compiled(kernel))


def jit_sums(kernel: Kernel) -> Kernel:
    """As `jit`, but sums are taken in any order: only so do they become vector instructions."""
    return cast(Kernel, _compiled(kernel, fastmath={"reassoc"}))


def jit_fast(kernel: Kernel) -> Kernel:
    """As `jit_sums`, and a product may be added without rounding it first; nothing may be nan."""
    return cast(Kernel, _compiled(kernel, fastmath={"reassoc", "contract", "nnan", "nsz"}))


def jit_inline(kernel: Kernel) -> Kernel:
    """As `jit`, but every call becomes the kernel's own code: for the smallest, in hot loops."""
    return cast(Kernel, _compiled(kernel, forceinline=True))


def _compiled(kernel: Callable[..., Any], **options: Any) -> Any:
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(kernel)
    find_template = compiled.get_call_template
    plain: Callable[[Any], Any] = types.unliteral

    def without_literals(args: Any, kws: Any) -> Any:
        return find_template(
            tuple(map(plain, args)), {name: plain(value) for name, value in kws.items()}
        )

    # numba compiles a kernel anew for every constant that another passes to it: once will do
    compiled.get_call_template = without_literals
    return compiled
