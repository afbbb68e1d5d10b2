"""Short, unique names of scenarios and strategies for figures and files."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from workbench.planning.scenarios.paper import PAPER_TITLES, is_scenario_file
from workbench.planning.strategies import PAPER_NAMES

MAX_FILE_NAME = 100


def scenario_title(name: str) -> str:
    """The paper's title; other names and paths of scenario files as they are."""
    return PAPER_TITLES.get(name, name)


def strategy_title(name: str) -> str:
    """The paper's spelling, of NAME@SOLVER too; others as they are."""
    base, at, solver = name.partition("@")
    return f"{PAPER_NAMES.get(base, base)}{at}{solver}"


def shortened(title: str, most: int) -> str:
    """A title shortened in the middle to at most `most` characters, since names differ at their ends."""
    if len(title) <= most:
        return title
    head = (most - 1) // 3
    return f"{title[:head]}…{title[len(title) - (most - 1 - head) :]}"


def file_name_of(name: str) -> str:
    """A file name for a name; if characters must be replaced, a hash is added to keep it unique."""
    last = Path(name).name if is_scenario_file(name) else name
    plain = re.sub(r"[^A-Za-z0-9+._@-]+", "-", last).strip("-.")[:MAX_FILE_NAME]
    return name if plain == name else f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
