"""A belief evaluation over several files of houses: all of them count, and folds take one."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

from workbench import cli
from workbench.worlds.shipped import shipped_houses


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Two files, of two houses and of one."""
    lines = gzip.decompress(shipped_houses().read_bytes()).splitlines()
    parts = {"two.jsonl": lines[:2], "one.jsonl": lines[2:3]}
    for name, some in parts.items():
        (tmp_path / name).write_bytes(b"\n".join(some) + b"\n")
    return tmp_path / "two.jsonl", tmp_path / "one.jsonl"


def test_every_file_counts(files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    def told(*some: Path) -> dict[str, object]:
        options = [word for path in some for word in ("--houses", str(path))]
        assert cli.run(["evaluate", "belief", *options, "-e", "counts", "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    two, one = files
    assert told(two, one)["houses"] == 3
    assert told(two, one)["files"] == [str(two), str(one)]
    assert told(two)["houses"] == 2


def test_folds_take_one_file(files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    two, one = map(str, files)
    assert cli.run(["evaluate", "belief", "--houses", two, "--houses", one, "--folds", "2"]) == 2
    assert "--also" in capsys.readouterr().err


def test_a_second_value_elsewhere_is_refused(files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    two, one = map(str, files)
    assert cli.run(["evaluate", "search", "--houses", two, "--houses", one]) == 2
    assert "--houses is given twice. It takes one value." in capsys.readouterr().err
