"""Without pandas, pyarrow and scipy, as in the default install: the main job works; tables name what to install."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

LOG = Path(__file__).parents[2] / "logs" / "find-lios.mcap"
WITHOUT = "import sys; sys.modules.update(pandas=None, pyarrow=None, scipy=None); from workbench.cli import run; "
INSTALL = "lios: making tables needs an optional part. Install it: pip install 'lios-workbench[tables]'."


def ran(code: str, folder: Path) -> tuple[str, str]:
    """What a process without these prints to its two outputs."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT + code], capture_output=True, text=True, check=True, cwd=folder, timeout=300
    )
    return done.stdout, done.stderr


@pytest.mark.parametrize("output", ["tables", "runs.csv", "runs.parquet"])
def test_export_names_what_to_install(output: str, tmp_path: Path) -> None:
    code, said = ran(f"print(run(['export', {str(LOG)!r}, '-o', {output!r}]))", tmp_path)
    assert (code.strip(), said.strip()) == ("2", INSTALL)
    assert not list(tmp_path.iterdir())


def test_frames_of_a_comparison_name_it_too(tmp_path: Path) -> None:
    code, said = ran("print(run(['compare', '.', '--frames']))", tmp_path)
    assert (code.strip(), said.strip()) == ("2", INSTALL)


def test_so_do_data_frames_in_python(tmp_path: Path) -> None:
    asked = f"""
import replayers
from workbench.errors import MissingExtra
kept = replayers.replay({str(LOG)!r}, "opt-greedy", settings=replayers.ReplaySettings(worlds=0))
for ask in (
    lambda: replayers.read({str(LOG)!r}).tables.runs,
    lambda: replayers.read_many({str(LOG)!r}).runs,
    lambda: kept.frame,
):
    try:
        ask()
    except MissingExtra as error:
        print(error)
"""
    assert ran(asked, tmp_path)[0].splitlines() == [INSTALL.removeprefix("lios: ")] * 3


@pytest.mark.ci
def test_the_main_job_works(tmp_path: Path) -> None:
    """With a house of one's own, whose travel costs no cache holds."""
    lines = (
        "new house flat",
        "record --house flat.yaml --find mug -o run.mcap",
        "replay run.mcap --strategies opt-greedy,lios -o kept",
        "compare kept",
        "figures run.mcap -o figures",
        "capsule run.mcap -o run.html",
        f"site from-log {LOG.with_name('spot-home-A.mcap')} -o draft",
        "evaluate search --queries 3 --policies lios -o searches",
        "evaluate tasks --trials 1 --scenarios find -s opt-greedy,lios -o tasks",
        "evaluate belief --estimators counts",
        "evaluate replay -n 2 --scenarios find -s opt-greedy,lios --estimators counts --worlds 5",
    )
    code, said = ran(f"print(*[run(line.split()) for line in {lines!r}])", tmp_path)
    assert code.split()[-len(lines) :] == ["0"] * len(lines), said
