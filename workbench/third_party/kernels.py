"""Functions compiled with numba, kept on disk, and loaded from there without the compiler.

Before numba loads the first function from its cache, it prepares to compile: it imports 170 modules, scipy's linear
algebra among them where scipy is installed, and registers all that it can translate. That takes a quarter of a second
of processor time, and machine code that is on disk needs none of it but the memory management. So the cache is asked
first here, and the compiler prepared where the cache does not hold the function.

What must not be compiled so: functions that hash strings, and parallel ones. Their machine code calls what numba
registers with those modules.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUntypedFunctionDecorator=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(**options: Any) -> Callable[[Function], Function]:
    """A decorator that compiles a function, keeps its machine code on disk, and releases the GIL in calls.

    Args:
        options: of numba.njit besides.
    """

    def compiled(function: Function) -> Function:
        made = cast(Any, njit(cache=True, nogil=True, **options)(function))
        if hasattr(made, "_cache"):  # not where compiling is switched off
            made._cache = _LoadedFirst(function)
        return made

    return compiled


class _LoadedFirst(FunctionCache):
    """A function's cache on disk, asked before the compiler is prepared."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
            if found is not None:
                return found
        return super().load_overload(sig, target_context)
