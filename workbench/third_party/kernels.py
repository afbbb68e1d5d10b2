"""Functions compiled with numba, kept on disk, and compiled anew where what they rest on has changed."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUntypedFunctionDecorator=false
# pyright: reportPrivateImportUsage=false

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from types import ModuleType
from typing import Any, TypeVar, cast, final

import numba
import numpy as np
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
    """A function's cache on disk, stale where its file, a called kernel's, what writes it, or a constant of another
    module has changed that one of these functions names.

    numba itself looks at the function's own file only. Which kernels a function calls is known once its module is
    loaded, so the file on disk is opened when it is first needed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function, self._opened = function, None
        super().__init__(function)

    @property
    def _cache_file(self) -> Any:
        if self._opened is None:
            called = _called(self._function)
            others = {loaded_kernels.__file__, *[one.__code__.co_filename for one in called]}
            files = sorted(others - {self._function.__code__.co_filename})
            stamps = [(file, os.stat(file).st_mtime, os.stat(file).st_size) for file in files]
            stamps += sorted({value for one in (self._function, *called) for value in _constants_of(one)})
            self._opened = caching.IndexDataCacheFile(
                cache_path=self._cache_path,
                filename_base=self._impl.filename_base,
                source_stamp=(*self._impl.locator.get_source_stamp(), *stamps),
            )
        return self._opened

    @_cache_file.setter
    def _cache_file(self, opened: Any) -> None:
        """numba sets one that knows the function's own file only."""


def _called(function: Callable[..., Any]) -> list[Callable[..., Any]]:
    """The functions behind all kernels that a function calls, and that those call."""
    found, waiting = list[Callable[..., Any]](), [function]
    while waiting:
        for called in _kernels_named_in(waiting.pop()):
            if called not in found:
                found.append(called)
                waiting.append(called)
    return found


def _constants_of(function: Callable[..., Any]) -> Iterator[str]:
    """What machine code holds of the values that a function's code names, and of the named tuples that it takes."""
    annotated = re.findall(r"\w+", " ".join(map(str, function.__annotations__.values())))
    for name, value in _named_in(function, annotated):
        if isinstance(value, type):
            fields = getattr(value, "_fields", None)
            if fields is not None:
                yield f"{name}{fields}"
        elif isinstance(value, bool | int | float | str | bytes | tuple | np.ndarray):
            yield f"{name} = {value!r}"


def _kernels_named_in(function: Callable[..., Any]) -> Iterator[Callable[..., Any]]:
    """The functions behind the kernels that a function's code names."""
    for _, value in _named_in(function):
        if hasattr(value, "py_func"):
            yield value.py_func


def _named_in(function: Callable[..., Any], more: Iterable[str] = ()) -> Iterator[tuple[str, Any]]:
    """The global values that a function's code names, alone or as members of a module, and others of its module."""
    names, there = function.__code__.co_names, function.__globals__
    for name in (*names, *more):
        found = there.get(name)
        if isinstance(found, ModuleType):
            yield from ((f"{name}.{member}", getattr(found, member, None)) for member in names)
        else:
            yield name, found


class _LoadedFirst(LoadedFirst, _StampedCache):
    """Such a cache, asked before the compiler is prepared."""

    _impl_class = MachineCode
