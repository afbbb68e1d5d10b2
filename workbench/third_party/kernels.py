"""Functions compiled with numba, kept on disk, and loaded from there without the compiler.

Before numba loads the first function from its cache, it prepares to compile: it imports 170 modules, scipy's linear
algebra among them where scipy is installed, and registers all that it can translate. That takes a quarter of a second
of processor time, and machine code that is on disk needs none of it but the memory management. So the cache is asked
first here, and the compiler prepared where the cache does not hold the function.

The cache also holds each function's LLVM code, for compiling others that call it. Parsing it takes as long as loading
the machine code, so it is parsed when numba first compiles something.

What must not be compiled so: functions that hash strings, and parallel ones. Their machine code calls what numba
registers with those modules. What else does may differ between versions and machines, so that this is done only
where it was tried; elsewhere numba loads its functions as usual.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUntypedFunctionDecorator=false
# pyright: reportPrivateImportUsage=false

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import cache
from types import ModuleType
from typing import Any, TypeVar, cast

import llvmlite.binding as llvm
import numba
from numba.core import caching, event
from numba.core.runtime.nrt import rtsys

Function = TypeVar("Function", bound=Callable[..., Any])

TRIED_VERSIONS = ("0.68.1",)
"""Of numba, on Linux on x86-64; what is used of it here is not part of its interface."""


def kernel(*, borrows: bool = False, **options: Any) -> Callable[[Function], Function]:
    """A decorator that compiles a function, keeps its machine code on disk, and releases the GIL in calls.

    It is compiled anew where its file, or that of a kernel which it calls, has changed.

    Args:
        borrows: it makes no arrays and returns none, so that the references to those that it is given need not be
            counted. Counting takes most of the time of a short function that takes arrays out of a named tuple.
        options: of numba.njit besides.
    """

    def compiled(function: Function) -> Function:
        uncounted = {"_nrt": False} if borrows else {}
        made = cast(Any, numba.njit(cache=True, nogil=True, **uncounted, **options)(function))
        if hasattr(made, "_cache"):  # it has none where compiling is switched off
            made._cache = (_LoadedFirst if is_tried() else _StampedCache)(function)
        return made

    return compiled


def is_tried() -> bool:
    """Whether functions are loaded without the compiler with this version of numba, on this machine."""
    system = os.uname() if hasattr(os, "uname") else None
    return (
        system is not None
        and (system.sysname, system.machine) == ("Linux", "x86_64")
        and numba.__version__ in TRIED_VERSIONS
    )


class _MachineCode(caching.CompileResultCacheImpl):
    """What is in the cache as a function: its machine code, and its LLVM code once something is compiled."""

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


class _StampedCache(caching.FunctionCache):
    """A function's cache on disk, stale where its file or that of a kernel which it calls has changed.

    numba itself looks at the function's own file only. Which kernels a function calls is known once its module is
    loaded, so the file on disk is opened when it is first needed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function, self._opened = function, None
        super().__init__(function)

    @property
    def _cache_file(self) -> Any:
        if self._opened is None:
            files = sorted(_files_of_called(self._function) - {self._function.__code__.co_filename})
            stamps = [(file, os.stat(file).st_mtime, os.stat(file).st_size) for file in files]
            self._opened = caching.IndexDataCacheFile(
                cache_path=self._cache_path,
                filename_base=self._impl.filename_base,
                source_stamp=(*self._impl.locator.get_source_stamp(), *stamps),
            )
        return self._opened

    @_cache_file.setter
    def _cache_file(self, opened: Any) -> None:
        """numba sets one that knows the function's own file only."""


def _files_of_called(function: Callable[..., Any]) -> set[str]:
    """The files of all kernels that a function calls, and that those call."""
    files, seen, waiting = set[str](), set[Callable[..., Any]](), [function]
    while waiting:
        one = waiting.pop()
        for called in _kernels_named_in(one):
            if called not in seen:
                seen.add(called)
                waiting.append(called)
                files.add(called.__code__.co_filename)
    return files


def _kernels_named_in(function: Callable[..., Any]) -> Iterator[Callable[..., Any]]:
    """The functions behind the kernels that a function's code names, alone or as members of a module."""
    names, there = function.__code__.co_names, function.__globals__
    for found in [there.get(name) for name in names]:
        members = [getattr(found, name, None) for name in names] if isinstance(found, ModuleType) else [found]
        for member in members:
            if hasattr(member, "py_func"):
                yield cast(Any, member).py_func


class _LoadedFirst(_StampedCache):
    """A function's cache on disk, asked before the compiler is prepared."""

    _impl_class = _MachineCode

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                found = self._load_overload(sig, target_context)
        except (EOFError, caching.pickle.UnpicklingError):  # a file that was cut off
            self.flush()
            found = None
        return found if found is not None else super().load_overload(sig, target_context)
