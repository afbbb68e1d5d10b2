"""Frozen values hold no state that changes: nothing writes to a field after __post_init__, nor into one."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest
from product_source import modules

CHANGES = ("append", "add", "update", "setdefault", "clear", "pop", "extend", "insert", "remove", "discard")
"""Methods that change a dict, list or set."""


def test_frozen_values_hold_no_state_that_changes() -> None:
    found = [f"{name}: {fault}" for name, tree in modules().items() for fault in faults(tree)]
    assert found == [], "compute it in __post_init__, or remember it in a workbench.caches.PerObject"


FROZEN = "@dataclass(frozen=True)\nclass A:\n    x: {type} = field({how})\n\n    def f(self): {body}"


@pytest.mark.parametrize(
    "source",
    [
        FROZEN.format(type="int", how="init=False", body="object.__setattr__(self, 'x', 1)"),
        FROZEN.format(type="dict[int, int]", how="default_factory=dict", body="self.x[1] = 2"),
        FROZEN.format(type="dict[int, int]", how="default_factory=dict", body="del self.x[1]"),
        FROZEN.format(type="dict[int, int]", how="default_factory=dict[int, int], repr=False", body="return 1"),
        FROZEN.format(type="Sequence[int]", how="", body="self.x.append(1)"),
        FROZEN.format(type="_Cache", how="default_factory=_Cache", body="self.x.found = 1"),
        "def g(a):\n    object.__setattr__(a, 'x', 1)",
        "class A(msgspec.Struct, frozen=True):\n    x: list[int]\n\n    def f(self): self.x.append(1)",
    ],
)
def test_each_way_of_hiding_state_is_found(source: str) -> None:
    assert list(faults(ast.parse(source)))


def test_values_derived_at_once_are_allowed() -> None:
    source = (
        "@dataclass(frozen=True)\nclass A:\n    x: Mapping[int, int] = field(init=False)\n\n"
        "    def __post_init__(self): object.__setattr__(self, 'x', {1: 2})\n\n"
        "    def f(self):\n        found = []\n        found.append(self.x[1])\n        return found"
    )
    assert list(faults(ast.parse(source))) == []


def faults(tree: ast.AST) -> Iterator[str]:
    allowed = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name in ("__init__", "__post_init__")
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "object.__setattr__" and id(node) not in allowed:
            yield ast.unparse(node)
        if isinstance(node, ast.ClassDef) and _is_frozen(node):
            yield from (f"{node.name}: {fault}" for fault in _faults_of_class(node))


def _is_frozen(node: ast.ClassDef) -> bool:
    keywords = [k for d in node.decorator_list if isinstance(d, ast.Call) for k in d.keywords]
    return any(
        k.arg == "frozen" and isinstance(k.value, ast.Constant) and k.value.value for k in (*keywords, *node.keywords)
    )


def _faults_of_class(node: ast.ClassDef) -> Iterator[str]:
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.value, ast.Call) and _is_hidden(part):
            yield ast.unparse(part)
    for part in ast.walk(node):
        if isinstance(part, ast.Assign | ast.AugAssign | ast.AnnAssign | ast.Delete):
            targets = part.targets if isinstance(part, ast.Assign | ast.Delete) else [part.target]
            yield from (ast.unparse(part) for target in targets if _is_in_field(target))
        if isinstance(part, ast.Call) and _changes_a_field(part.func):
            yield ast.unparse(part)


def _changes_a_field(function: ast.expr) -> bool:
    return isinstance(function, ast.Attribute) and function.attr in CHANGES and _is_field(function.value)


def _is_hidden(part: ast.AnnAssign) -> bool:
    """A private field, or one left out of comparisons, that begins as an empty dict, list or set."""
    made = ast.unparse(part)
    private = isinstance(part.target, ast.Name) and part.target.id.startswith("_")
    empty = any(f"default_factory={kind}" in made for kind in ("dict", "list", "set", "defaultdict"))
    return empty and (private or "repr=False" in made or "compare=False" in made)


def _is_in_field(target: ast.expr) -> bool:
    """self.field[...] or self.field.part; self.field itself cannot be assigned anyway."""
    return isinstance(target, ast.Subscript | ast.Attribute) and _is_field(target.value)


def _is_field(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"
