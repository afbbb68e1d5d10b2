"""The product's own source, parsed once, for tests of how it is written; xdist_group("source") has them share a
worker.
"""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TypeVar

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("workbench", "recorders", "replayers", "dashboards")
Node = TypeVar("Node", bound=ast.AST)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


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
def _nodes() -> tuple[tuple[str, ast.AST], ...]:
    found = tuple((name, node) for name, tree in modules().items() for node in _walk(tree))
    gc.freeze()  # they stay: the collector need not look through them again and again
    return found


def nodes(*kinds: type[Node]) -> Iterator[tuple[str, Node]]:
    """Every node of some kinds, with the name of its module."""
    return ((name, node) for name, node in _nodes() if isinstance(node, kinds))
