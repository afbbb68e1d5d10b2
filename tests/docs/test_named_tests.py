"""Tests that the documentation names: the files exist, and so do the functions and the words of `-k`."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from console_blocks import ROOT

_SPAN = re.compile(r"^```.*?^```$|`[^`]+`", re.MULTILINE | re.DOTALL)
_TEST = re.compile(r"(?<![\w/.-])((?:\w+/)*test_\w+\.py)((?:::\w+)*)")
_FOLDER = re.compile(r"(?<![\w/.-])(tests/[\w/]+)(?=$|[\s`,/])(?!\.)")
_WORDS = re.compile(r"""(?<!\S)-k[ =](?:"([^"]+)"|'([^']+)'|([\w.-]+))""")
_MADE_UP = re.compile(r"test_my_\w+\.py")
"""Files that a reader writes."""
FILES = {path.name: path for path in (ROOT / "tests").rglob("test_*.py")}
"""By name, which is unique (tests/test_architecture.py)."""


def _names(path: Path) -> set[str]:
    """The names of a file's test classes and functions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = {node.name for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    return {name for name in found if name.lower().startswith("test")}


def _faults(page: str) -> list[str]:
    """What is named in the code of a page and does not exist."""
    faults: list[str] = []
    for span in (line for match in _SPAN.finditer(page) for line in _lines(match.group())):
        faults += [f"{name}: no such folder" for name in _FOLDER.findall(span) if not (ROOT / name).exists()]
        known: set[str] = set()
        for name, inside in _TEST.findall(span):
            path = FILES.get(Path(name).name)
            if _MADE_UP.search(name):
                continue
            if path is None or ("/" in name and not path.as_posix().endswith(f"/{name}")):
                faults.append(f"{name}: no such file")
                continue
            known |= _names(path)
            faults += [f"{name}: no {one}" for one in inside.split("::") if one and one not in _names(path)]
        words = [word for found in _WORDS.findall(span) for word in "".join(found).split()] if known else []
        faults += [
            f"{span.strip('`')}: no test named {word}"
            for word in words
            if word not in ("and", "or", "not") and not any(word in name for name in known)
        ]
    return faults


def _lines(code: str) -> list[str]:
    """The lines of a block; a span in a sentence is one, wherever it was wrapped."""
    return code.splitlines() if code.startswith("```") else [" ".join(code.split())]


@pytest.mark.parametrize("page", sorted((ROOT / "docs").rglob("*.md")), ids=lambda p: str(p.relative_to(ROOT)))
def test_tests_named_in_the_documentation_exist(page: Path) -> None:
    assert _faults(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("`test_named_tests.py -k documentation`, `tests/docs`", 0),
        ("`pytest tests/docs/test_named_tests.py::test_what_is_not_there_is_told`", 0),
        ('`test_named_tests.py -k "documentation or not_there"`', 0),
        ("`test_named_tests.py -k absent`", 1),
        ('`test_named_tests.py -k "documentation\nor absent"`', 1),
        ("`pytest tests/docs/test_named_tests.py::test_absent`", 1),
        ("`tests/planning/test_named_tests.py`", 1),
        ("```sh\npytest tests/absent/\npytest test_absent.py\n```", 2),
    ],
)
def test_what_is_not_there_is_told(text: str, faults: int) -> None:
    assert len(_faults(text)) == faults
