"""Compiled functions loaded from disk without numba's compiler.

Before numba loads the first function from its cache, it prepares to compile: it imports 170 modules, scipy's linear
algebra among them where scipy is installed, and registers all that it can translate. That takes a quarter of a second
of processor time, and machine code that is on disk needs none of it but the functions that manage memory. So the
cache is asked first here, and the compiler prepared where the cache does not hold the function. Until then these wait
too:

- The LLVM code of the functions in the cache, for compiling others that call them. Parsing it takes as long as
  loading the machine code.
- LLVM code that counts references, which is compiled for linking with what is compiled. Machine code on disk has it.
- The search for extensions of numba among all that is installed. They add types, and kernels take numpy's own.

What must not be loaded so: functions that hash strings, and parallel ones. Their machine code calls what numba
registers with those modules. What else does may differ between versions and machines, so that this is done only
where it was tried; elsewhere numba loads its functions as usual.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportPrivateImportUsage=false

from __future__ import annotations

import os
from functools import cache
from typing import Any, cast

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import caching, event, types
from numba.core.errors import NumbaNotImplementedError
from numba.core.runtime import _nrt_python as memory  # pyright: ignore[reportAttributeAccessIssue]
from numba.core.typing.typeof import typeof_impl
from numba.np import numpy_support

TRIED_VERSIONS = ("0.68.1",)
"""Of numba, on Linux on x86-64; what is used of it here is not part of its interface."""


def is_tried() -> bool:
    """Whether functions are loaded without the compiler with this version of numba, on this machine."""
    system = os.uname() if hasattr(os, "uname") else None
    return (
        system is not None
        and (system.sysname, system.machine) == ("Linux", "x86_64")
        and numba.__version__ in TRIED_VERSIONS
    )


def load_first(compiled: Any) -> None:
    """Has a function, whose cache is a LoadedFirst, do nothing else before it asks its cache."""
    _tell_types_of_arrays()
    compiled._compilation_chain_init_hook = _search_no_extensions


def _search_no_extensions() -> None:
    """numba searches for them before it works out the types of arguments, and again when it prepares to compile."""


class LoadedFirst(caching.FunctionCache):
    """A function's cache on disk, asked before the compiler is prepared."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        _name_memory_functions()
        try:
            with self._guard_against_spurious_io_errors():
                found = self._load_overload(sig, target_context)
        except (EOFError, caching.pickle.UnpicklingError):  # a file that was cut off
            self.flush()
            found = None
        return found if found is not None else super().load_overload(sig, target_context)


class MachineCode(caching.CompileResultCacheImpl):
    """What is in the cache as a function: its machine code, and its LLVM code once something is compiled."""

    def reduce(self, cres: Any) -> Any:
        """Without the environments that no code reads.

        Each function of numba that a kernel calls has one, for messages with values in them. To load one, numba
        imports the function's module.
        """
        *stored, environments = super().reduce(cres)
        code = str(cres.library._final_module)
        return (*stored, tuple(one for one in environments if code.count(f"@{one.env_name}") > 1))

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        (name, kind, stored), described, *rest = payload
        later = _llvm_code().later
        if later is None or kind != "object":
            return super().rebuild(target_context, payload)
        machine_code, llvm_code = stored
        # Without LLVM code numba would not know that there is such a function in the machine code.
        target_context.codegen()._engine._defined_symbols.add(described.llvm_cpython_wrapper_name)
        made = super().rebuild(target_context, ((name, kind, (machine_code, _no_code())), described, *rest))
        later.append((made.library, llvm_code))
        return made


class _LlvmCode(event.Listener):
    """The LLVM code of functions that were loaded without it, given to them before anything is compiled.

    Attributes:
        later: each function's library and its code; None once something was compiled.
    """

    def __init__(self) -> None:
        self.later: list[tuple[Any, bytes]] | None = []
        event.register("numba:run_pass", self)

    def on_start(self, event: Any) -> None:
        given, self.later = self.later or (), None
        for library, code in given:
            library._shared_module = cast(Any, llvm).parse_bitcode(code)
            library.codegen._engine._load_defined_symbols(library._shared_module)

    def on_end(self, event: Any) -> None:
        pass


@cache
def _llvm_code() -> _LlvmCode:
    return _LlvmCode()


@cache
def _no_code() -> bytes:
    return cast(Any, llvm).parse_assembly("").as_bitcode()


@cache
def _name_memory_functions() -> None:
    """Tells LLVM where the functions that manage memory are, by the names that machine code has for them."""
    for name, address in memory.c_helpers.items():
        cast(Any, llvm).add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


@cache
def _tell_types_of_arrays() -> None:
    """Has numba tell the type of an array without importing numpy.ma.

    numba imports it to refuse masked arrays; one of numpy's own class is none.
    """
    theirs = typeof_impl.dispatch(np.ndarray)

    def type_of_array(value: Any, context: Any) -> Any:
        if type(value) is not np.ndarray:
            return theirs(value, context)
        try:
            dtype = numpy_support.from_dtype(value.dtype)
        except NumbaNotImplementedError:
            return theirs(value, context)
        return types.Array(dtype, value.ndim, numpy_support.map_layout(value), readonly=not value.flags.writeable)

    typeof_impl.register(np.ndarray, type_of_array)
