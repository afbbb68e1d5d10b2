"""Third-party estimators: every fault is one line that names the estimator."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import toy

from workbench.beliefs import guarded_estimator
from workbench.beliefs.belief import Belief
from workbench.beliefs.guarded_estimator import EstimatorFailed, GuardedEstimator
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG, EGG = ItemType("Mug"), ItemType("Egg")


class Fine:
    name = "fine"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        probability = np.full((len(item_types), len(knowledge.unsearched)), 0.5)
        print("thinking")
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )


class Raises(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        raise RuntimeError("no\nidea")


class Exits(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        sys.exit(0)


class Hangs(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        while True:
            try:
                time.sleep(0.01)
            except Exception:  # noqa: BLE001  it does not want to be stopped
                continue


class NaN(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        shape = (len(item_types), len(knowledge.unsearched))
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=np.full(shape, np.nan), estimator="x"
        )


class Text(Fine):
    values: Any = "0.5"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        probability = np.full((len(item_types), len(knowledge.unsearched)), self.values)
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )


class Complex(Text):
    values = 0.5 + 0.1j


class NoNumbers(Text):
    values = None


class NeverSeen(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return replace(super().believe(knowledge, item_types), p_detect=(float("nan"),))


class NameOfNone(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return replace(super().believe(knowledge, item_types), estimator=None)  # a log with it could not be read


class AList(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return replace(super().believe(knowledge, item_types), item_types=[*item_types])


class Turned(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        shape = (len(knowledge.unsearched), len(item_types))
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=np.zeros(shape), estimator="x"
        )


class AnArray(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return np.zeros((len(item_types), len(knowledge.unsearched)))


class Nothing(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return None


class OtherTypes(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        return super().believe(knowledge, (EGG,))


class AllContainers(Fine):
    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Any:
        names = tuple(c.id for c in knowledge.plan.containers)
        return Belief(
            item_types=item_types,
            containers=names,
            probability=np.zeros((len(item_types), len(names))),
            estimator="x",
        )


FAULTS = {
    Raises: "it raised RuntimeError: no idea",
    Exits: "it raised SystemExit: 0",
    Hangs: "it did not answer within 0.2 s",
    NaN: r"the probability of Mug in \S+ is nan; it must be within \[0, 1\]",
    Text: "the type of the belief's probabilities is 'str96'; it must be a number's",
    Complex: "the type of the belief's probabilities is 'complex128'; it must be a number's",
    NoNumbers: "the type of the belief's probabilities is 'object'; it must be a number's",
    NeverSeen: "a detection probability is nan; it must be above 0 and at most 1",
    NameOfNone: "its belief has estimator of type NoneType, not str",
    AList: "its belief has item_types of type list, not tuple",
    Turned: r"it must be of shape \(1, 4\)",
    AnArray: "it returned ndarray instead of a Belief",
    Nothing: "it returned nothing instead of a Belief",
    OtherTypes: "its belief is about Egg, and was asked about Mug",
    AllContainers: "its belief names 5 containers",
}


def known() -> Knowledge:
    house = toy.toy_house()
    return knowledge_at_start(house.plan, toy.toy_travel(), {toy.FRIDGE: house.contents[toy.FRIDGE]})


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_is_one_line(kind: type[Fine]) -> None:
    with pytest.raises(EstimatorFailed, match=FAULTS[kind]) as told:
        GuardedEstimator(kind(), 0.2 if kind is Hangs else 60.0).believe(known(), (MUG,))
    assert str(told.value).startswith("estimator 'fine': ")
    assert "\n" not in str(told.value)
    assert told.value.exit_code == 2


def test_one_that_behaves_is_passed_on_and_prints_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    belief = GuardedEstimator(Fine()).believe(known(), (MUG,))
    assert belief.probability.tolist() == [[0.5] * 4]
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "thinking\n")


def test_the_usual_limit_is_read_when_it_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guarded_estimator, "BELIEF_LIMIT_S", 0.1)
    with pytest.raises(EstimatorFailed, match=r"within 0\.1 s"):
        GuardedEstimator(Hangs()).believe(known(), (MUG,))
