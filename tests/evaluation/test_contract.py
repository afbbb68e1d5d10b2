"""The contract of estimators: the built-in ones keep it, and each rule finds who breaks it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import toy

from workbench.beliefs.belief import Belief
from workbench.beliefs.estimators import ESTIMATORS, estimator
from workbench.evaluation.beliefs.contract import broken_rules
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge


class Keeps:
    """By the lengths of names."""

    name = "keeps"
    names_alone = True

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        rows = [[1 / (len(t) + len(c)) for c in knowledge.unsearched] for t in item_types]
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.array(rows).reshape(len(item_types), len(knowledge.unsearched)),
            estimator=self.name,
        )


class Forgets(Keeps):
    """Counts how often it was asked."""

    calls = 0

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        self.calls += 1
        belief = super().believe(knowledge, item_types)
        return Belief(
            item_types=item_types,
            containers=belief.containers,
            probability=belief.probability / self.calls,
            estimator=self.name,
        )


class ByOrder(Keeps):
    """The first type is more probable."""

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        belief = super().believe(knowledge, item_types)
        rank = np.arange(1, len(item_types) + 1)[:, None]
        return Belief(
            item_types=item_types,
            containers=belief.containers,
            probability=belief.probability / rank,
            estimator=self.name,
        )


class Moved(Keeps):
    """Says that it is not."""

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        count = len(knowledge.unsearched)
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.full((len(item_types), count), 1 / max(1, count)),
            estimator=self.name,
        )


class Raises(Keeps):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        if not knowledge.unsearched:
            raise ZeroDivisionError
        return super().believe(knowledge, item_types)


class Nameless(Keeps):
    name = ""


BROKEN = {
    Forgets: "gave another belief when it was asked again",
    ByOrder: "another order of item types",
    Moved: "it says names_alone",
    Raises: "it raised ZeroDivisionError",
    Nameless: "its name is ''",
}


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_built_in_estimators_keep_it(name: str) -> None:
    assert broken_rules(estimator(name), toy.toy_house()) == ()


@pytest.mark.parametrize("kind", BROKEN)
def test_each_rule_finds_who_breaks_it(kind: type[Keeps]) -> None:
    assert broken_rules(Keeps()) == ()
    broken = broken_rules(kind(), toy.toy_house())
    assert any(BROKEN[kind] in line for line in broken), broken


def test_what_is_no_estimator_is_one_line() -> None:
    (line,) = broken_rules(object())
    assert "it is object; an estimator has name and believe" in line


def test_one_that_is_costly_is_asked_about_each_state_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Costly(Keeps):
        costly = True
        asked: list[object] = []  # noqa: RUF012

        def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
            self.asked.append((knowledge.unsearched, tuple(knowledge.first_seen.items()), item_types))
            return super().believe(knowledge, item_types)

    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    assert broken_rules(Costly(), toy.toy_house()) == ()
    assert len(set(Costly.asked)) == len(Costly.asked) == 10
