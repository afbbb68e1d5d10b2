"""The posterior belief after looks that could have missed the item: Bayes, look by look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dashboards.model.belief_series import Series
from dashboards.model.timeline import Timeline
from workbench.beliefs.after_looks import posterior_after_misses


@dataclass(frozen=True, slots=True, kw_only=True)
class FruitlessLooks:
    """Looks into one container that did not show an item that they could have missed.

    Attributes:
        p_detect: the chance that the last of them detects the item where it is.
        posterior: (stamp, probability that it is there nevertheless): what the last decision before the first look
            believed, and one more after each look of the whole run.
        by_now: how many of them were made by the moment.
    """

    p_detect: float
    posterior: Series
    by_now: int

    @property
    def prior(self) -> float:
        return self.posterior[0][1]

    @property
    def left(self) -> float:
        """The chance that is left at the moment."""
        return self.posterior[self.by_now][1]


def fruitless_looks(timeline: Timeline, container: str, item_type: str, stamp_ns: int) -> FruitlessLooks | None:
    """The looks in vain up to the one that showed the item; None where looks show everything or nothing is believed.

    Each look detects the item, where it is, with p_detect of the log. It starts from what the last decision before it
    believed, or from what the look before it left where no decision since counts the container.
    """
    believed = _beliefs(timeline, container, item_type)
    posterior: list[tuple[int, float]] = []
    p_detect = 1.0
    for seen in sorted(timeline.run.observations, key=lambda o: o.stamp.ns):
        if seen.container != container or seen.known_at_start or seen.look is None:
            continue
        detection = dict(zip(seen.look.item_types, seen.look.p_detect, strict=True))
        if item_type not in detection or any(item.type == item_type for item in seen.items):
            break
        before = max((b for b in believed if b[0] <= seen.stamp.ns), default=None)
        if not posterior and before is None:
            return None
        if not posterior and before is not None:
            posterior.append(before)
        start = before if before is not None and before[0] > posterior[-1][0] else posterior[-1]
        p_detect = detection[item_type]
        left = posterior_after_misses(np.array(start[1]), np.array(1.0 - p_detect))
        posterior.append((seen.stamp.ns, float(left)))
    if not posterior:
        return None
    return FruitlessLooks(
        p_detect=p_detect, posterior=posterior, by_now=sum(at <= stamp_ns for at, _ in posterior[1:])
    )


def _beliefs(timeline: Timeline, container: str, item_type: str) -> list[tuple[int, float]]:
    """(stamp, probability) of each decision that believes something of it."""
    found: list[tuple[int, float]] = []
    for frame in timeline.decisions:
        belief = frame.belief
        if belief is not None and item_type in belief.item_types and container in belief.containers:
            row, column = belief.item_types.index(item_type), belief.containers.index(container)
            found.append((frame.stamp_ns, float(belief.probability[row][column])))
    return found
