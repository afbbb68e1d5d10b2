"""Errors keep their message when they cross into another process."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from workbench.errors import (
    BadValue,
    Failed,
    FileMissing,
    LiosError,
    MalformedFile,
    MissingExtra,
    OutputExists,
    UnknownName,
)
from workbench.planning.scenarios.house_items import ScenarioUnsupported


@pytest.mark.parametrize(
    "error",
    [
        Failed("the work failed"),
        FileMissing(Path("run.mcap")),
        OutputExists("out"),
        MalformedFile("tea.yaml:3:5", "no such key", "Give another"),
        BadValue("--trials", 0, "at least 1"),
        UnknownName("strategy", "lioss", ("lios", "greedy")),
        MissingExtra("a Dask cluster", "cluster"),
        ScenarioUnsupported("house 3", "coffee", "no mug"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_travels_whole(error: LiosError) -> None:
    arrived = pickle.loads(pickle.dumps(error))  # noqa: S301  our own bytes
    assert type(arrived) is type(error)
    assert str(arrived) == str(error)
    assert arrived.exit_code == error.exit_code
    assert vars(arrived) == vars(error)


def test_what_was_not_given_is_said_so() -> None:
    assert str(BadValue("-o/--output", None, "a folder")) == "-o/--output is not given; it must be a folder."


def test_many_known_names_are_cut_and_a_question_mark_lists_all() -> None:
    names = [f"name{i:02d}" for i in range(30)]
    assert str(UnknownName("thing", "x", names)).endswith("name10, name11, and 18 more, which '?' lists.")
    assert str(UnknownName("thing", "?", names)).endswith("name28, name29.")
    assert str(UnknownName("thing", "x", names[:24])).endswith("name22, name23."), "a few are listed at once"


def test_the_end_of_a_long_path_is_told() -> None:
    path = Path("/data", "a" * 60, "b" * 60, "runs")
    assert str(BadValue("-o/--output", path, "a folder")) == f"-o/--output is '{path}'; it must be a folder."
    assert str(BadValue("--name", "c" * 100, "short")) == f"--name is '{'c' * 76}...; it must be short."
