"""The product's own source, parsed once, for tests of how it is written; work_groups has them share a worker."""

from __future__ import annotations

import ast
import gc
import heapq
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TypeVar, cast

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("workbench", "recorders", "replayers", "dashboards")
Node = TypeVar("Node", bound=ast.AST)


@cache
def parsed(path: Path) -> ast.Module:
    with _no_collector():
        return ast.parse(path.read_text(encoding="utf-8"))


@contextmanager
def _no_collector() -> Iterator[None]:
    """While trees grow, there is no garbage, and looking for it takes longer than parsing."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def statements(tree: ast.AST) -> Iterator[ast.AST]:
    """Every statement; a tenth of the nodes, among them all functions and classes."""
    left = [tree]
    while left:
        node = left.pop()
        yield node
        for part in ("handlers", "cases", "finalbody", "orelse", "body"):
            inner = getattr(node, part, ())
            left += reversed(inner) if isinstance(inner, list) else ()


@cache
def files() -> tuple[Path, ...]:
    """Every module of the product, sorted."""
    return tuple(sorted(path for room in PRODUCT for path in (ROOT / room).rglob("*.py")))


@cache
def modules() -> Mapping[str, ast.Module]:
    """By name, such as "workbench/files.py"."""
    return {path.relative_to(ROOT).as_posix(): parsed(path) for path in files()}


def _walk(tree: ast.AST) -> Iterator[ast.AST]:
    """Every node, as ast.walk gives them in another order and three times as slowly; without contexts (ast.Load)."""
    left = [tree]
    while left:
        node = left.pop()
        yield node
        for value in node.__dict__.values():
            if isinstance(value, list):
                left += [part for part in value if isinstance(part, ast.AST)]
            elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
                left.append(value)


@cache
def _nodes() -> Mapping[type[ast.AST], list[tuple[int, str, ast.AST]]]:
    """Every node by its class, with its number and the name of its module."""
    found: dict[type[ast.AST], list[tuple[int, str, ast.AST]]] = {}
    with _no_collector():
        all_of_them = ((name, node) for name, tree in modules().items() for node in _walk(tree))
        for number, (name, node) in enumerate(all_of_them):
            found.setdefault(type(node), []).append((number, name, node))
    gc.freeze()  # they stay: the collector need not look through them again and again
    return found


def nodes(*kinds: type[Node]) -> Iterator[tuple[str, Node]]:
    """Every node of some kinds, with the name of its module."""
    of_kinds = [found for kind, found in _nodes().items() if issubclass(kind, kinds)]
    return ((name, cast(Node, node)) for _, name, node in heapq.merge(*of_kinds))
