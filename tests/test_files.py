"""Atomic writes leave the old file or the new one, and nothing else; names become file names that differ."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import pytest
from product_source import nodes

from workbench.files import atomic, draft_path, file_name_of, remove_abandoned_drafts, write_atomically


def test_a_write_that_fails_leaves_the_old_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_atomically(path, b"old")
    with pytest.raises(RuntimeError):
        _write_half(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def _write_half(path: Path) -> None:
    with atomic(path) as draft:
        draft.write_bytes(b"half")
        raise RuntimeError


def test_a_link_is_followed_and_a_device_is_written_itself(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_atomically(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"
    write_atomically(Path("/dev/null"), b"new")
    assert not Path("/dev/null").is_file()


def test_an_error_names_the_file_and_not_its_draft(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "a.json"
    with pytest.raises(FileNotFoundError) as raised:
        write_atomically(path, b"new")
    assert raised.value.filename == str(path)


def test_drafts_of_running_processes_stay(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    draft_path(path).write_bytes(b"half")
    remove_abandoned_drafts(path.parent)
    assert draft_path(path).exists()


def test_file_names_differ_and_fit() -> None:
    names = (
        "model-lios",
        "a/b",
        "a:b",
        "a_b",
        "a-b",
        "Küche",
        "台所",
        "",
        ".",
        "..",
        "x" * 999,
        "台" * 999,
        "\udcff",
    )
    files = [file_name_of(name) for name in names]
    assert len(set(files)) == len(files)
    assert all(len(os.fsencode(file)) < 120 and "/" not in file and file not in ("", ".", "..") for file in files)
    assert (files[0], files[5], files[6]) == ("model-lios", "Küche", "台所")


def test_one_module_renames_and_names_drafts() -> None:
    found = [
        f"{name}: {ast.unparse(node)}"
        for name, node in nodes(ast.AST)
        if name not in ("workbench/files.py", "replayers/tables/export.py") and _renames_or_drafts(node)
    ]
    assert found == [], "write with workbench.files.atomic or write_atomically"


def _renames_or_drafts(node: ast.AST) -> bool:
    """Path.replace has one argument, str.replace has two."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "replace":
        return len(node.args) == 1 and not node.keywords
    names = ("os.replace", "os.rename", "os.getpid", "tempfile.mkstemp", "NamedTemporaryFile")
    return isinstance(node, ast.Attribute | ast.Name) and ast.unparse(node) in names


WRITES_ELSEWHERE = (
    "workbench/planning/solvers/",  # folders of their own, for other programs
    "workbench/evaluation/solvers.py",
    "recorders/spot/simulated/services/server.py",
    "dashboards/rendering/chromium.py",
    "workbench/files.py",
)


def test_outputs_are_written_as_a_whole() -> None:
    found = [
        f"{name}: {ast.unparse(node)}"
        for name, node in nodes(ast.Call)
        if not name.startswith(WRITES_ELSEWHERE)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in ("write_text", "write_bytes", "savefig")
        and not any(isinstance(word, ast.Name) and word.id in ("draft", "stream") for word in ast.walk(node))
    ]
    assert found == [], "write with workbench.files.write_text or write_atomically"
