"""What did the robot believe? The log's own first belief, as an estimator for whoever replays it.

A counterfactual asks what another planner would have done with the same belief. Where the log's beliefs never
changed about a pair (the estimators that go by names alone), its first one is all there is to know; otherwise the
estimator that the log names is asked again.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import numpy as np

from replayers.evidence import Evidence
from workbench.beliefs.belief import Belief, Estimator
from workbench.errors import LiosError, Unsupported
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge


class NoBelief(Unsupported):
    """A replay needs beliefs that neither the log nor an estimator can give."""

    def __init__(self, log: str, estimator: str, reason: str) -> None:
        super().__init__(
            f"{log}: its beliefs do not cover this task and its estimator {estimator!r} cannot be had here "
            f"({reason}). Name another with --estimator."
        )


@final
@dataclass(frozen=True, slots=True)
class LoggedBelief:
    """Answers with the first probability that the log holds; 0 for a pair that it does not name."""

    evidence: Evidence

    @property
    def name(self) -> str:
        return self.evidence.info.estimator or "logged"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        containers, first = knowledge.unsearched, self.evidence.first_belief
        rows = [[first.get((t, c), 0.0) for c in containers] for t in item_types]
        probability = np.array(rows, dtype=np.float64).reshape(len(item_types), len(containers))
        return Belief(item_types=item_types, containers=containers, probability=probability, estimator=self.name)


def covers(evidence: Evidence, item_types: Iterable[ItemType]) -> bool:
    """Whether the log's first beliefs name every container that a run may search, for these types."""
    places = [c for c in (*evidence.contents, *evidence.open, *evidence.shut) if c not in evidence.known]
    reachable = [c for c in places if evidence.place.travel.reaches(c)]
    return all((t, c) in evidence.first_belief for t in item_types for c in reachable)


def estimator_for(
    evidence: Evidence, item_types: tuple[ItemType, ...], *, name: str = "log"
) -> tuple[Estimator, str]:
    """Who believes in a replay, and a note where that is not who believed in the run.

    Args:
        name: "log" takes the log's own belief where it suffices; "same" asks the estimator that the log names
            first; another name is one of the estimators' table.

    Raises:
        NoBelief: nothing suffices.
        UnknownName: no such estimator.
    """
    from workbench.beliefs.estimators import estimator

    if name not in ("log", "same"):
        return estimator(name), f"beliefs by {name}; the run used {evidence.info.estimator}"
    sufficient = evidence.steady and covers(evidence, item_types)
    if name == "log" and sufficient:
        return LoggedBelief(evidence), ""
    recorded = evidence.info.estimator
    try:
        found = estimator(recorded.partition("@")[0])
    except LiosError as error:
        if covers(evidence, item_types):
            return LoggedBelief(evidence), "the log's first belief stands in for its estimator"
        raise NoBelief(evidence.path, recorded, str(error)) from error
    if found.name != recorded and sufficient:
        return LoggedBelief(evidence), ""
    return found, "" if found.name == recorded else f"beliefs by {found.name}; the run used {recorded}"
