"""Exceptions and arguments that docstrings name exist."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from console_blocks import ROOT
from product_source import parsed, statements

FOLDERS = ("workbench", "recorders", "replayers", "dashboards")
SECTION = re.compile(r"^Raises:\n((?:[ ]+.*\n?)+)", re.MULTILINE)
ARGUMENTS = re.compile(r"^Args:\n((?: {4}.*\n?|\n)+)", re.MULTILINE)
NAMES = re.compile(r"^ {4}([A-Z]\w+(?:, [A-Z]\w+)*):", re.MULTILINE)


def _modules() -> Iterator[tuple[Path, ast.Module]]:
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT), parsed(path)


@pytest.mark.ci
def test_exceptions_named_in_docstrings_exist() -> None:
    known, named = set(dir(builtins)), list[tuple[str, str]]()
    for path, module in _modules():
        for node in statements(module):
            if isinstance(node, ast.ClassDef):
                known.add(node.name)
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                for section in SECTION.findall((ast.get_docstring(node) or "") + "\n"):
                    given = ", ".join(NAMES.findall(section)).split(", ")
                    named += [(f"{path}: {node.name}", name) for name in given if name]
    assert len(named) > 300
    assert [(where, name) for where, name in named if name not in known] == []


@pytest.mark.ci
def test_arguments_named_in_docstrings_exist() -> None:
    named = [
        (f"{path}: {node.name}", name, _arguments(node))
        for path, module in _modules()
        for node in statements(module)
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        for section in ARGUMENTS.findall((ast.get_docstring(node) or "") + "\n")
        for line in section.splitlines()
        if re.match(r" {4}\w", line)
        for name in line.strip().split(":")[0].split(", ")
    ]
    assert len(named) > 600
    assert [(where, name) for where, name, known in named if known and name not in known] == []


def _arguments(node: ast.FunctionDef | ast.ClassDef) -> set[str]:
    """The names of a function's parameters, or of a class's fields and constructor; none if it inherits them."""
    if isinstance(node, ast.FunctionDef):
        given = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg)
        return {a.arg for a in given if a is not None}
    known = {p.target.id for p in node.body if isinstance(p, ast.AnnAssign) and isinstance(p.target, ast.Name)}
    made = [p for p in node.body if isinstance(p, ast.FunctionDef) and p.name == "__init__"]
    return known.union(*map(_arguments, made)) if made or not node.bases else set()
