"""Functions compiled with numba, kept on disk, and compiled anew where what they rest on has changed."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUntypedFunctionDecorator=false
# pyright: reportPrivateImportUsage=false

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import cached_property
from types import ModuleType
from typing import Any, TypeVar, cast, final

import numba
from numba.core import caching

from workbench.third_party import loaded_kernels
from workbench.third_party.loaded_kernels import LoadedFirst, MachineCode, is_tried, load_first

Function = TypeVar("Function", bound=Callable[..., Any])


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
        made = cast(Any, numba.njit(nogil=True, **uncounted, **options)(function))
        if hasattr(made, "_cache"):  # it has none where compiling is switched off
            made._cache = _OpenedLater(function)
            if is_tried():
                load_first(made)
        return made

    return compiled


@final
class _OpenedLater:
    """A function's cache on disk, opened when it is first asked.

    To open one, numba writes a file to the folder and removes it; most kernels of a module are not called in a run.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @cached_property
    def _opened(self) -> caching.FunctionCache:
        return (_LoadedFirst if is_tried() else _StampedCache)(self._function)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._opened, name)


class _StampedCache(caching.FunctionCache):
    """A function's cache on disk, stale where its file, a called kernel's, or what writes it has changed.

    numba itself looks at the function's own file only. Which kernels a function calls is known once its module is
    loaded, so the file on disk is opened when it is first needed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function, self._opened = function, None
        super().__init__(function)

    @property
    def _cache_file(self) -> Any:
        if self._opened is None:
            others = {loaded_kernels.__file__, *_files_of_called(self._function)}
            files = sorted(others - {self._function.__code__.co_filename})
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


class _LoadedFirst(LoadedFirst, _StampedCache):
    """Such a cache, asked before the compiler is prepared."""

    _impl_class = MachineCode
