"""Questions of estimators that answer with a whole belief: one for each state of knowledge."""

from __future__ import annotations

import hashlib
from typing import final

import msgspec
import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.belief import Estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed, checked_belief
from workbench.caches import Cache
from workbench.worlds.house import FloorPlan, ItemType
from workbench.worlds.knowledge import Knowledge

MAX_STATES = 64
"""States that are remembered between a question and its answer."""


class _State(msgspec.Struct, frozen=True, kw_only=True):
    """What an estimator may go by: the place, what is asked for, and what was seen."""

    place: str
    item_types: tuple[str, ...]
    unsearched: tuple[str, ...]
    seen: dict[str, tuple[str, ...]]


@final
class StateQuestions:
    """An AskingEstimator of an ordinary one with `costly = True`: it asks about states of knowledge.

    Args:
        name: the estimator's.
        estimator: who believes; None in a replay that asks nobody.
        names_alone: no observation changes its beliefs.
    """

    def __init__(self, name: str, estimator: Estimator | None, *, model: str = "", names_alone: bool = False) -> None:
        self.name, self.model, self.names_alone = name, model or name, names_alone
        self._estimator = estimator
        self._states: Cache[str, tuple[Knowledge, tuple[ItemType, ...]]] = Cache(MAX_STATES)

    def questions(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[str, ...]:
        state = _State(
            place=_place(knowledge.plan),
            item_types=tuple(item_types),
            unsearched=tuple(knowledge.unsearched),
            seen={
                str(c): tuple(sorted(str(i.type) for i in items)) for c, items in sorted(knowledge.first_seen.items())
            },
        )
        question = msgspec.json.encode(state).decode()
        self._states.put(question, (knowledge, item_types))
        return (question,)

    def ask(self, question: str) -> str:
        state = self._states.get(question, self._forgotten)
        if self._estimator is None:
            raise EstimatorFailed(self.name, "it is not here")
        made = checked_belief(self._estimator.believe(*state), self.name, *state)
        return msgspec.json.encode(made.probability.tolist()).decode()

    def probabilities(
        self, knowledge: Knowledge, item_types: tuple[ItemType, ...], answers: tuple[str, ...]
    ) -> Floats:
        try:
            rows = msgspec.json.decode(answers[0], type=list[list[float]])
            return np.array(rows, dtype=np.float64).reshape(len(item_types), len(knowledge.unsearched))
        except (msgspec.MsgspecError, ValueError) as error:
            raise EstimatorFailed(self.name, f"a recorded answer is not a belief: {error}") from error

    def _forgotten(self) -> tuple[Knowledge, tuple[ItemType, ...]]:
        raise EstimatorFailed(self.name, "it answers a question that was not asked")


def _place(plan: FloorPlan) -> str:
    """The place by name, and a hash of its rooms and containers."""
    rooms = sorted((str(r.id), r.kind) for r in plan.rooms)
    containers = [(str(c.id), c.type, str(c.room)) for c in plan.containers]
    return f"{plan.name} {hashlib.sha256(repr((rooms, containers)).encode()).hexdigest()[:16]}"
