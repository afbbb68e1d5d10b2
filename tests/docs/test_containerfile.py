"""The container file names existing paths and options, checked without a container engine."""

from __future__ import annotations

import json
import re
import subprocess
from fnmatch import fnmatch
from pathlib import Path

import pytest
from console_blocks import ROOT

from workbench import cli

LINES = re.sub(r"\\\n", " ", (ROOT / "Containerfile").read_text(encoding="utf-8")).splitlines()


def _after(word: str) -> list[str]:
    return [line.removeprefix(word).strip() for line in LINES if line.startswith(word + " ")]


def _sources() -> list[str]:
    return [source for line in _after("COPY") for source in line.split()[:-1]]


@pytest.mark.parametrize("source", _sources())
def test_what_is_copied_is_there_and_not_ignored(source: str) -> None:
    assert (ROOT / source).exists()
    listed = subprocess.run(["git", "ls-files", source], cwd=ROOT, capture_output=True, text=True, check=False)
    assert listed.returncode != 0 or listed.stdout, f"{source} is not part of the project"
    ignored = (ROOT / ".containerignore").read_text(encoding="utf-8").split()
    assert not any(fnmatch(source, pattern) for pattern in ignored)


def test_all_that_the_package_is_made_of_is_copied() -> None:
    pyproject = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found = re.search(r"include = \[(.*?)\]", pyproject)
    assert found
    packages = re.findall(r'"(\w+)\*"', found[1])
    assert len(packages) == 4
    assert set(_sources()) >= {*packages, "pyproject.toml", "constraints.txt", "README.md", "LICENSE"}


def test_it_starts_the_dashboard(capsys: pytest.CaptureFixture[str]) -> None:
    assert _after("ENTRYPOINT") == ['["lios"]']
    (command,) = [json.loads(line) for line in _after("CMD")]
    assert command[0] == "view"
    cli.run(["view", "--help"])
    offered = capsys.readouterr().out
    assert [word for word in command if word.startswith("--") and word not in offered] == []
    port = command[command.index("--port") + 1]
    assert _after("EXPOSE") == [port]
    how_to = Path(ROOT / "docs" / "how-to.md").read_text(encoding="utf-8")
    assert f"127.0.0.1:{port}:{port}" in how_to


def test_it_does_not_run_as_root() -> None:
    assert _after("USER") not in ([], ["root"])
