"""One spelling of numba's decorator for every kernel in mocapdb.

numba is imported when a kernel is called for the first time, so that a command without kernels
starts quickly. The machine code is kept on disk for the next process. It is compiled again when
anything that it was made from changes: the kernel, the kernels that it calls, or a number that it
takes from its module.

Without numba, as in a program that brings its own Python, the kernels run as plain Python: the same
results, far slower, which a warning says once.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from types import CodeType, ModuleType
from typing import Any, TypeVar, cast

__all__ = [
    "Kernel",
    "are_compiled",
    "before_compiling",
    "jit",
    "jit_fast",
    "jit_inline",
    "jit_sums",
]

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def jit(kernel: Kernel) -> Kernel:
    """Compile a kernel on first use and keep the machine code for the next process.

    Division by zero gives inf or nan as in numpy, and the interpreter's lock is released.
    """
    return cast(Kernel, _Compiled(kernel))


def jit_sums(kernel: Kernel) -> Kernel:
    """As `jit`, but sums may be taken in any order, so that they become vector instructions."""
    return cast(Kernel, _Compiled(kernel, fastmath={"reassoc"}))


def jit_fast(kernel: Kernel) -> Kernel:
    """As `jit_sums`, and a product may be added without rounding it first; nothing may be nan."""
    return cast(Kernel, _Compiled(kernel, fastmath={"reassoc", "contract", "nnan", "nsz"}))


def jit_inline(kernel: Kernel) -> Kernel:
    """As `jit`, but the code is copied to where it is called: for small kernels in inner loops."""
    return cast(Kernel, _Compiled(kernel, forceinline=True))


def before_compiling(say: Callable[[], None] | None) -> None:
    """Register a function that is called once, before the first kernel has to be compiled."""
    _WATCH.say = say


@cache
def are_compiled() -> bool:
    """Return whether kernels become machine code: whether numba is installed."""
    from importlib.util import find_spec

    return find_spec("numba") is not None


class _Compiled:
    """A kernel, compiled when it is first called.

    Parameters
    ----------
    function : callable
        The kernel, as it is written.
    **options
        For numba, besides those that all kernels share.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        self.function = function
        self.options = options
        _WATCH.functions.add(function)
        update_wrapper(self, function)

    def __call__(self, *args: Any) -> Any:
        return self.dispatcher(*args)

    @cached_property
    def dispatcher(self) -> Any:
        """The compiled kernel that Python calls."""
        with _LOCK:
            if not are_compiled():
                _warn_of_plain_python()
                return self.function
            return self.__dict__.get("dispatcher") or _dispatcher(self)

    @cached_property
    def inner(self) -> Any:
        """The compiled kernel that other kernels call."""
        with _LOCK:
            return self.__dict__.get("inner") or _inner_dispatcher(self)

    @cached_property
    def stamp(self) -> str:
        """A hash of everything that the machine code is made from."""
        from hashlib import sha256

        parts = ["4"]  # version of how kernels are compiled here; raise it after a change
        seen: set[int] = set()
        _describe(self, parts, seen)
        return sha256("\n".join(parts).encode()).hexdigest()


_LOCK = threading.RLock()
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def _dispatcher(kernel: _Compiled) -> Any:
    numba = _numba()
    from mocapdb.base._compilers import KernelCache, OuterCompiler

    decorate = numba.njit(pipeline_class=OuterCompiler, **_OPTIONS, **kernel.options)
    compiled: Any = decorate(kernel.function)
    compiled._cache = KernelCache(kernel.function)  # type: ignore[no-untyped-call]
    # numba itself would only compare the time at which the kernel's file was changed
    compiled._cache._cache_file._source_stamp = kernel.stamp
    return compiled


def _inner_dispatcher(kernel: _Compiled) -> Any:
    numba = _numba()
    from numba.core import types

    from mocapdb.base._compilers import InnerCompiler

    decorate = numba.njit(pipeline_class=InnerCompiler, **_OPTIONS, **kernel.options)
    compiled: Any = decorate(kernel.function)
    find_template = compiled.get_call_template

    def without_literals(args: Any, kws: Any) -> Any:
        return find_template(
            tuple(map(types.unliteral, args)),
            {name: types.unliteral(value) for name, value in kws.items()},  # type: ignore[no-untyped-call]
        )

    # numba would compile it once for every constant that another kernel passes to it
    compiled.get_call_template = without_literals
    return compiled


@cache
def _warn_of_plain_python() -> None:
    import warnings

    warnings.warn(
        "numba is not installed: kernels run as plain Python, a hundred times slower or more.",
        RuntimeWarning,
        stacklevel=4,
    )


@cache
def _numba() -> Any:
    """Import numba, and teach it to call a `_Compiled` from a kernel."""
    import numba
    from numba.core import event
    from numba.extending import typeof_impl

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            _WATCH.note(event, +1)

        def on_end(self, event: Any) -> None:
            _WATCH.note(event, -1)

    def type_of(kernel: _Compiled, context: Any) -> Any:
        return typeof_impl(kernel.inner, context)

    typeof_impl.register(_Compiled)(type_of)
    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]
    return numba


class _Watch:
    """Counts the kernels being compiled: says so once, and stops garbage collection meanwhile."""

    def __init__(self) -> None:
        self.say: Callable[[], None] | None = None
        self.functions: set[Callable[..., Any]] = set()  # our kernels; numba also reports others
        self._depth = 0  # above 1 while a kernel compiles the kernels that it calls
        self._collects = False

    def note(self, event: Any, step: int) -> None:
        """Note that compiling a kernel begins (+1) or ends (-1)."""
        compiled = event.data["dispatcher"]
        if compiled.py_func not in self.functions:
            if self._depth and step > 0:  # a function of numba's own that a kernel calls
                from mocapdb.base._compilers import InnerCompiler

                compiled._compiler.pipeline_class = InnerCompiler
            return
        self._depth += step
        if self._depth == 1 and step > 0:
            # numba makes millions of objects; collecting garbage would take a tenth of the time
            self._collects = gc.isenabled()
            gc.disable()
            if self.say is not None:
                self.say()
                self.say = None
        elif self._depth == 0 and self._collects:
            gc.enable()


_WATCH = _Watch()


# -- what machine code comes from ------------------------------------------------------------------


def _describe(value: Any, parts: list[str], seen: set[int]) -> None:
    """Add what numba compiles into the machine code of a value from a kernel's module."""
    import numpy as np

    if isinstance(value, _Compiled):
        if id(value) not in seen:
            seen.add(id(value))
            options = {
                name: flags if flags is True else sorted(flags)
                for name, flags in value.options.items()
            }
            parts.append(f"{value.function.__qualname__} {options}")
            _describe_code(value.function.__code__, value.function.__globals__, parts, seen)
    elif isinstance(value, np.ndarray):
        parts.append(f"{value.dtype} {value.shape} {value.tolist()!r}")
    elif isinstance(value, tuple):  # it may hold kernels
        parts.append(f"{len(value)}")
        for item in value:
            _describe(item, parts, seen)
    elif callable(value):  # a type, or a function that numba knows
        parts.append(f"{value.__module__}.{getattr(value, '__qualname__', '')}")
    else:
        parts.append(repr(value))


def _describe_code(
    code: CodeType, module: dict[str, Any], parts: list[str], seen: set[int]
) -> None:
    parts.append(f"{code.co_code!r} {code.co_names} {code.co_varnames}")
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            _describe_code(constant, module, parts, seen)
        else:
            parts.append(repr(constant))
    for name in code.co_names:
        value = module.get(name)
        if not isinstance(value, ModuleType):
            _describe(value, parts, seen)
        elif value.__name__.startswith("mocapdb."):  # a module of constants or kernels
            for attribute in code.co_names:  # attributes are listed beside other names
                if hasattr(value, attribute):
                    _describe(getattr(value, attribute), parts, seen)
