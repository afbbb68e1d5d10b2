"""Caches are bounded, keep what was used lately, and go with the object that they are about."""

from __future__ import annotations

import ast
import gc

import pytest
from product_source import files, nodes

from workbench.caches import Cache, PerObject


@pytest.mark.parametrize("size", [2, 3, 10])
def test_a_cache_keeps_at_most_its_size_and_at_least_half_of_it(size: int) -> None:
    cache: Cache[int, int] = Cache(size)
    for key in range(50):
        assert cache.get(key, lambda key=key: -key) == -key
        assert len(cache) <= size
    assert all(key in cache for key in range(50 - size // 2, 50))


def test_what_is_used_stays() -> None:
    cache: Cache[int, object] = Cache(4)
    first = cache.get(0, object)
    for key in range(1, 50):
        cache.get(key, object)
        assert cache.get(0, object) is first


def test_a_value_may_be_none_and_is_made_once() -> None:
    cache: Cache[str, None] = Cache(4)
    made: list[str] = []
    for _ in range(3):
        cache.get("a", lambda: made.append("a"))
    assert made == ["a"]


def test_what_raises_is_not_kept() -> None:
    cache: Cache[str, int] = Cache(4)
    with pytest.raises(ZeroDivisionError):
        cache.get("a", lambda: 1 // 0)
    assert "a" not in cache
    assert cache.get("a", lambda: 1) == 1


def test_what_is_dropped_is_made_again() -> None:
    cache: Cache[str, int] = Cache(4)
    cache.put("a", 1)
    cache.drop("a")
    assert cache.find("a") is None
    assert cache.get("a", lambda: 2) == 2


class Owner:
    """Equal to every other one, and yet not the same."""

    def __eq__(self, other: object) -> bool:
        return True

    __hash__ = None  # type: ignore[assignment]


@pytest.mark.ci
def test_caches_of_objects_are_apart_and_go_with_them() -> None:
    caches: PerObject[str, int] = PerObject(4)
    one, other = Owner(), Owner()
    assert caches.of(one).get("a", lambda: 1) == 1
    assert caches.of(other).get("a", lambda: 2) == 2
    assert caches.of(one).get("a", lambda: 3) == 1
    del one
    gc.collect()
    assert len(caches) == 1


def test_no_function_with_arguments_is_cached_without_bound() -> None:
    found = [str(path) for path in files() if "OrderedDict" in path.read_text(encoding="utf-8")]
    found += [f"{name}: {node.name}" for name, node in nodes(ast.FunctionDef) if _is_unbounded(node)]
    assert found == [], "give lru_cache a size, or use workbench.caches.Cache"


def _is_unbounded(node: ast.FunctionDef) -> bool:
    told = {ast.unparse(decorator) for decorator in node.decorator_list}
    forever = told & {"cache", "functools.cache", "lru_cache(maxsize=None)"}
    return bool(forever and (node.args.args or node.args.kwonlyargs))
