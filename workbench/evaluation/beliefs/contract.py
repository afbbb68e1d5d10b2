"""The contract of estimators, as checks that anybody can run on theirs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from workbench.beliefs.asking.answered_estimator import AnsweredEstimator, uses_names_alone
from workbench.beliefs.belief import Estimator
from workbench.beliefs.estimators import NoEstimator, wrapped_estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.evaluation.beliefs.metrics import dummy_travel_costs
from workbench.tolerances import NEAR_PROBABILITY
from workbench.worlds.house import ContainerId, House, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.procthor.load import load_house

TYPES = (ItemType("Mug"), ItemType("Pillow"), ItemType("NobodyHasHeardOfIt"))


def broken_rules(estimator: object, house: House | None = None) -> tuple[str, ...]:
    """The rules of its contract that an estimator breaks, one line each; empty if it keeps all of them.

    It is asked about a dozen states of one house, as a run would ask. One whose answers cost something is asked each
    question once, and its answers are kept in the cache.

    Args:
        estimator: an Estimator or AskingEstimator, as `--estimator module:Class` would make it.
        house: to believe in; a shipped one by default.
    """
    try:
        used = wrapped_estimator(estimator)
    except NoEstimator as error:
        return (str(error),)
    chosen = house if house is not None else load_house("houses:0")
    broken: dict[str, None] = {}
    for check in (_answers, _repeats, _order_of_types, _names_alone):
        try:
            broken.update(dict.fromkeys(check(used, chosen)))
        except EstimatorFailed as error:
            broken[str(error)] = None
    return tuple(broken)


def _answers(estimator: Estimator, house: House) -> Iterator[str]:
    """It answers for every state of knowledge, also for no item types."""
    for knowledge in _states(house):
        for types in ((), TYPES[:1], TYPES):
            estimator.believe(knowledge, types)
    if not estimator.name or not estimator.name.isprintable():
        yield f"its name is {estimator.name!r}; it must be one line of text"


def _repeats(estimator: Estimator, house: House) -> Iterator[str]:
    """The same knowledge gives the same belief, whatever was asked in between."""
    states = _states(house)
    before = [estimator.believe(knowledge, TYPES) for knowledge in states]
    after = [estimator.believe(knowledge, TYPES) for knowledge in reversed(states)][::-1]
    if not all(np.array_equal(a.probability, b.probability) for a, b in zip(before, after, strict=True)):
        yield "the same knowledge gave another belief when it was asked again"


def _order_of_types(estimator: Estimator, house: House) -> Iterator[str]:
    """A row does not depend on its position among the item types."""
    knowledge = _states(house)[1]
    if isinstance(estimator, AnsweredEstimator):
        return  # another order is another question, which costs something
    turned = estimator.believe(knowledge, TYPES[::-1])
    apart = estimator.believe(knowledge, TYPES).probability - turned.only(TYPES).probability
    if np.abs(apart).max(initial=0.0) > NEAR_PROBABILITY:
        yield "another order of item types gave other probabilities"


def _names_alone(estimator: Estimator, house: House) -> Iterator[str]:
    """With names_alone, no observation changes its beliefs: replays rely on that for exact bounds."""
    if not uses_names_alone(estimator):
        return
    nothing, *others = (estimator.believe(knowledge, TYPES) for knowledge in _states(house))
    for belief in others:
        columns = [nothing.containers.index(c) for c in belief.containers]
        if np.abs(nothing.probability[:, columns] - belief.probability).max(initial=0.0) > NEAR_PROBABILITY:
            yield "it says names_alone, and what was seen changed its belief"
            return


def _states(house: House) -> tuple[Knowledge, ...]:
    """Nothing seen, a container seen, half of them, one of them empty, all but one, and all."""
    names, travel = tuple(c.id for c in house.plan.containers), dummy_travel_costs(house.plan)

    def seen(containers: tuple[ContainerId, ...]) -> Knowledge:
        return knowledge_at_start(house.plan, travel, {c: house.contents[c] for c in containers})

    empty = knowledge_at_start(house.plan, travel, {names[0]: ()})
    return (seen(()), seen(names[:1]), empty, seen(names[::2]), seen(names[:-1]), seen(names))
