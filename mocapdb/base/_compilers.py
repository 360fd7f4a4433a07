"""How numba compiles kernels; those that only kernels call get no machine code of their own.

By default numba optimises every function and turns it into machine code; a function that calls it
then includes it and optimises it again. Here only what Python calls is optimised and turned into
machine code, once, with everything that it calls.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from numba.core import typed_passes, untyped_passes
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager
from numba.core.runtime.nrt import rtsys

__all__ = ["InnerCompiler", "KernelCache", "OuterCompiler"]


class _OuterLibrary(JITCodeLibrary):
    """The code of functions that Python calls."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Do not optimise a function alone: this is done once, with all that it calls."""
        ll_module.data_layout = self._codegen._data_layout


class _InnerLibrary(JITCodeLibrary):
    """The code of functions that only other functions call, kept unoptimised."""

    def finalize(self) -> None:
        """Include all functions that these call."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


class _Flags(Flags):
    """A function's options; two are equal if they differ only in what concerns the function itself.

    numba compiles a function again for every caller whose options are not equal.
    """

    __slots__ = ()

    def __hash__(self) -> int:
        return hash(_Flags)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Flags) and self._of_calls() == other._of_calls()

    def _of_calls(self) -> dict[str, Any]:
        return {name: value for name, value in self._values.items() if name not in _OWN}


# options that concern a function itself, and not the functions that it calls
_OWN = {"forceinline", "no_cfunc_wrapper", "no_compile", "no_cpython_wrapper", "release_gil"}


# numba's passes that kernels need: those for generators, closures and whole arrays are left out
_PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)


class OuterCompiler(Compiler):
    """numba's compiler, for functions that Python calls."""

    def __init__(
        self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, local: Any
    ) -> None:
        flags = _Flags(flags)  # type: ignore[no-untyped-call]
        if library is None:
            library = _OuterLibrary(target.codegen(), "outer")  # type: ignore[no-untyped-call]
            library.enable_object_caching()
        super().__init__(  # type: ignore[no-untyped-call]
            typing, target, library, args, result, flags, local
        )

    def define_pipelines(self) -> Any:
        """Return the passes for a kernel; a function that comes with numba keeps numba's own."""
        if self.state.func_id.modname.startswith("numba."):
            return super().define_pipelines()  # type: ignore[no-untyped-call]
        manager: Any = PassManager("kernel")  # type: ignore[no-untyped-call]
        for each in _PASSES:
            manager.add_pass(each, each.__name__)
        manager.finalize()
        return [manager]


class InnerCompiler(OuterCompiler):
    """numba's compiler, for functions that only others call."""

    def __init__(
        self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, local: Any
    ) -> None:
        library = _InnerLibrary(target.codegen(), "inner")  # type: ignore[no-untyped-call]
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().__init__(typing, target, library, args, result, flags, local)

    def _compile_core(self) -> Any:
        made: Any = super()._compile_core()  # type: ignore[no-untyped-call]
        # numba needs a Python function as key; this one is never called
        key: Callable[..., Any] = [].pop
        made.target_context.insert_user_function(key, made.fndesc, [made.library])
        return made._replace(entry_point=key)


class KernelCache(FunctionCache):
    """Machine code on disk; it is loaded without importing what numba needs to compile."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code kept for a signature, or None where it has to be compiled."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            kept = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            if kept is not None:
                return kept
        _prepare_to_compile()
        return None


def _prepare_to_compile() -> None:
    """Import the slowest part of what numba needs to compile, without scipy.

    numba imports scipy.linalg only to see whether BLAS is there, which takes a third of the time.
    scipy is always installed with mocapdb, and code that calls BLAS imports it when it runs.
    """
    from numba.np import linalg

    look_for_blas, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    import_module("numba.np.arraymath")
    linalg.ensure_blas = look_for_blas
