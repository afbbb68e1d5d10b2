"""`lios new`: what it writes runs at once, passes its own test, and never replaces a file unasked."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workbench import cli


@pytest.mark.parametrize(
    ("kind", "name", "address"),
    [
        ("planner", "rooms-first", "rooms_first:RoomsFirst"),
        ("policy", "worth_first", "worth_first:WorthFirst"),
        ("estimator", "Mine", "mine:Mine"),
    ],
)
def test_it_says_the_address_and_the_files_compile(
    kind: str, name: str, address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["new", kind, name, "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == address
    module, _, class_name = address.partition(":")
    text = (tmp_path / f"{module}.py").read_text()
    assert f"class {class_name}:" in text
    assert "$" not in text
    for file in (f"{module}.py", f"test_{module}.py"):
        compile((tmp_path / file).read_text(), file, "exec")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["planner", "policy", "estimator"])
def test_its_own_test_passes(kind: str, tmp_path: Path) -> None:
    assert cli.run(["new", kind, "of-mine", "-o", str(tmp_path)]) == 0
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_of_mine.py"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.parametrize("name", ["9lives", "a b", "../x", "class", "json", "numpy", "", "-"])
def test_names_that_are_no_module_or_another_one_are_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["new", "planner", "-o", str(tmp_path), "--", name]) == 2
    assert "NAME" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "test_mine_too.py").write_text("keep")
    assert cli.run(["new", "planner", "mine-too", "-o", str(tmp_path)]) == 2
    assert [p.name for p in tmp_path.iterdir()] == ["test_mine_too.py"]
    assert cli.run(["new", "planner", "mine-too", "-o", str(tmp_path), "--force"]) == 0
    assert "$" not in (tmp_path / "test_mine_too.py").read_text()


def test_a_survey_that_would_stop_no_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["new", "site", "our-lab"]) == 0
    assert capsys.readouterr().out.strip() == "our-lab/site.yaml"
    assert len(Path("our-lab/site.yaml").read_text().splitlines()) <= 15
    assert cli.run(["site", "check", "our-lab/site.yaml"]) == 0
    assert cli.run(["new", "site", "our-lab"]) == 2
    assert cli.run(["new", "site", ".."]) == 2
