"""Names of runs shown together: the strategy alone where it is enough, what differs where it is not."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import msgspec
from toy_run import other_run, toy_run

from dashboards.model.run_names import run_names
from dashboards.palette import RUNS
from replayers.runs.run import Run


def _run(file: str = "toy.mcap", **info: object) -> Run:
    ours = toy_run()
    return replace(ours, path=Path(file), info=msgspec.structs.replace(ours.info, **info))


def test_strategies_that_differ_are_the_whole_name() -> None:
    assert run_names([toy_run(), other_run()]) == ["lios", "greedy"]


def test_what_differs_is_added_only_where_strategies_are_the_same() -> None:
    assert run_names([_run(seed=1), _run(seed=2), other_run()]) == ["lios, seed 1", "lios, seed 2", "greedy"]
    assert run_names([_run(estimator="counts"), _run(estimator="lm")]) == ["lios, counts", "lios, lm"]
    assert run_names([_run(), _run(source="replay")]) == ["lios", "lios, replay"]


def test_files_tell_apart_what_nothing_else_does() -> None:
    assert run_names([_run("a.mcap"), _run("b.mcap")]) == ["lios, a.mcap", "lios, b.mcap"]
    assert run_names([_run("x/a.mcap"), _run("y/a.mcap")]) == ["lios #1", "lios #2"]


def test_twenty_runs_of_one_task_all_differ() -> None:
    runs = [_run(f"{i}.mcap", seed=i % 5, strategy=("lios", "greedy")[i % 2]) for i in range(20)]
    assert len(set(run_names(runs))) == 20


def test_more_runs_than_colours_have_numbers_and_no_fewer() -> None:
    runs = [_run(f"{i}.mcap", seed=i) for i in range(len(RUNS) + 1)]
    assert run_names(runs[:-1])[0] == "lios, seed 0"
    assert run_names(runs) == [f"{i + 1}: lios, seed {i}" for i in range(len(RUNS) + 1)]


def test_a_file_name_that_is_no_text_is_shown() -> None:
    """Two runs that only their files tell apart, one of them with a name in another encoding."""
    assert run_names([_run("a.mcap"), _run(os.fsdecode(b"\xff.mcap"))]) == ["lios, a.mcap", "lios, \ufffd.mcap"]
