"""Short, unique names of scenarios and strategies for figures and files."""

from __future__ import annotations

from pathlib import Path

from workbench.files import file_name_of
from workbench.planning.scenarios.paper import PAPER_TITLES, is_scenario_file
from workbench.planning.strategies import PAPER_NAMES


def scenario_title(name: str) -> str:
    """The paper's title; other names and paths of scenario files as they are."""
    return PAPER_TITLES.get(name, name)


def strategy_title(name: str) -> str:
    """The paper's spelling, of NAME@SOLVER too; others as they are."""
    base, at, solver = name.partition("@")
    return f"{PAPER_NAMES.get(base, base)}{at}{solver}"


def shortened(title: str, max_chars: int) -> str:
    """A title shortened in the middle to at most `max_chars` characters, since names differ at their ends."""
    if len(title) <= max_chars:
        return title
    head = (max_chars - 1) // 3
    return f"{title[:head]}…{title[len(title) - (max_chars - 1 - head) :]}"


def scenario_file_name(name: str) -> str:
    """A file name for a scenario; a scenario file is recognised by the last part of its path."""
    return file_name_of(name, shown=Path(name).name if is_scenario_file(name) else None)
