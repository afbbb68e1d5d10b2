"""The product's own source, parsed once, for tests of how it is written; xdist_group("source") has them share a
worker.
"""

from __future__ import annotations

import ast
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


@cache
def files() -> tuple[Path, ...]:
    """Every module of the product, sorted."""
    return tuple(sorted(path for room in PRODUCT for path in (ROOT / room).rglob("*.py")))


@cache
def modules() -> Mapping[str, ast.Module]:
    """By name, such as "workbench/files.py"."""
    return {path.relative_to(ROOT).as_posix(): parsed(path) for path in files()}


@cache
def _nodes() -> tuple[tuple[str, ast.AST], ...]:
    return tuple((name, node) for name, tree in modules().items() for node in ast.walk(tree))


def nodes(*kinds: type[Node]) -> Iterator[tuple[str, Node]]:
    """Every node of some kinds, with the name of its module."""
    return ((name, node) for name, node in _nodes() if isinstance(node, kinds))
