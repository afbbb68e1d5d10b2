"""Exceptions that docstrings name exist."""

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
pytestmark = pytest.mark.xdist_group("source")
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
