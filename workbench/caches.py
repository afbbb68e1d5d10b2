"""The cache of this software: bounded, in two generations, so that what was used lately stays.

It serves where a key is computed from parts of the arguments; functools.lru_cache with a size serves functions whose
arguments are the key. Frozen values hold no cache: what is cached about one of them is in a PerObject beside the code
that uses it, and is dropped together with the value.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar, cast, final

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")

_MISSING = object()


@final
class Cache(Generic[K, V]):
    """Values by key, at most `size`; at least the half of that used last is kept.

    Threads may share one: at worst two of them make the same value.

    Args:
        size: at least 2.
    """

    __slots__ = ("_half", "_new", "_old", "size")

    def __init__(self, size: int) -> None:
        self.size = size
        self._half = max(1, size // 2)
        self._new: dict[K, V] = {}
        self._old: dict[K, V] = {}

    def get(self, key: K, make: Callable[[], V]) -> V:
        """The value of a key, made if it is not there. What make raises is not kept."""
        value = self._new.get(key, _MISSING)
        if value is _MISSING:
            value = self._old.get(key, _MISSING)
            if value is _MISSING:
                value = make()
            self.put(key, cast(V, value))
        return cast(V, value)

    def find(self, key: K) -> V | None:
        """The value of a key, or None."""
        value = self._new.get(key)
        if value is None and key in self._old:
            value = self._old[key]
            self.put(key, value)
        return value

    def put(self, key: K, value: V) -> None:
        """Keep a value, in place of an earlier one of its key."""
        if len(self._new) >= self._half and key not in self._new:
            self._old, self._new = self._new, {}
        self._new[key] = value

    def drop(self, key: K) -> None:
        """Forget the value of a key, if there is one."""
        self._new.pop(key, None)
        self._old.pop(key, None)

    def __contains__(self, key: K) -> bool:
        return key in self._new or key in self._old

    def __len__(self) -> int:
        return len(self._new) + sum(key not in self._new for key in self._old)


@final
class PerObject(Generic[K, V]):
    """One cache for each of many objects, distinguished by identity; it goes with its object.

    Args:
        size: of each cache.
    """

    __slots__ = ("_caches", "_size")

    def __init__(self, size: int) -> None:
        self._size = size
        self._caches: dict[int, tuple[weakref.ref[Any], Cache[K, V]]] = {}

    def of(self, owner: object) -> Cache[K, V]:
        """The cache of an object, which can be referred to weakly."""
        entry = self._caches.get(id(owner))
        if entry is not None and entry[0]() is owner:
            return entry[1]
        number, caches = id(owner), self._caches

        def forget(gone: weakref.ref[Any]) -> None:
            entry = caches.get(number)
            if entry is not None and entry[0] is gone:
                del caches[number]

        made: Cache[K, V] = Cache(self._size)
        caches[number] = (weakref.ref(owner, forget), made)
        return made

    def __len__(self) -> int:
        return len(self._caches)
