"""Results of actions without an id: each counts, none hides the next."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from replayers.importers.message_handlers import BagDerivation


def told_before(keys: list[str]) -> list[bool]:
    reading: Any = object.__new__(BagDerivation)
    reading._done = set()
    return [reading._already_recorded(SimpleNamespace(key=key)) for key in keys]


def test_results_without_a_key_are_always_new() -> None:
    assert told_before(["", "", ""]) == [False, False, False]


def test_results_with_a_key_count_once() -> None:
    assert told_before(["goal-1", "", "goal-1", "goal-2"]) == [False, False, True, False]
