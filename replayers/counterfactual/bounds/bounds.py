"""Least and greatest cost of a strategy over every world that is consistent with the log, and what each bound rests
on.

These are the result types only; the branch-and-bound search that computes them is a separate module.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from math import inf

from replayers.counterfactual.results import BoundFigures, Proof, WorldGroup
from replayers.counterfactual.run_tree import Leaf
from workbench.execution.events import RunStatus
from workbench.message_enum import MessageEnum, Result
from workbench.tolerances import NEAR_COST

MAX_WORLD_GROUPS = 2000
"""Groups of worlds, for comparisons world by world; beyond this, the bounds alone are kept."""


class OuterReason(MessageEnum):
    """Why an end of the interval is an outer bound, or unknown."""

    BELIEFS = "what else the open containers hold may change what it believes, and it is not followed beyond that"
    BUDGET = (
        "after {segments} segments more runs were left that might cost less or more than could be followed (--budget "
        "sets how many)"
    )
    COMBINATIONS = "a container can hold more combinations of items than are followed"
    DETOURS = "it does not go straight, or nobody knows whether it does, so that no upper bound is known"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds(BoundFigures):
    """Figures with what they were found by.

    Attributes:
        segments: how many segments of the loop it took.
        cut: whether some run was not followed because beliefs that are not known decide how it goes on.
        unfinished: whether the search stopped before it had followed every run that could cost least or most.
        unlisted: whether some container can hold more combinations of items than are followed.
        cheapest, most_expensive: ends that cost least_found and largest_found: worlds that one can look at.
        groups: what is known of the cost in each group of worlds, all together; empty when there are too many.
    """

    segments: int
    cut: bool = False
    unfinished: bool = False
    unlisted: bool = False
    cheapest: Leaf | None = None
    most_expensive: Leaf | None = None
    groups: tuple[WorldGroup, ...] = ()

    @property
    def figures(self) -> BoundFigures:
        return BoundFigures(**{f.name: getattr(self, f.name) for f in fields(BoundFigures)})

    @property
    def why_outer(self) -> tuple[Result[OuterReason], ...]:
        """Why an end of the interval is not reached; () where both are."""
        if self.lower_proof is self.upper_proof is Proof.EXACT:
            return ()
        reasons = {
            OuterReason.BELIEFS: self.cut,
            OuterReason.BUDGET: self.unfinished,
            OuterReason.COMBINATIONS: self.unlisted,
            OuterReason.DETOURS: self.upper_proof is Proof.NONE,
        }
        return tuple(reason.result(segments=str(self.segments)) for reason, holds in reasons.items() if holds)

    def with_ends(self, leaves: Iterable[Leaf | None]) -> Bounds:
        """The same, with these ends of runs taken into account: each is in some consistent world.

        An end beyond the bounds shows that the strategy does not go straight (Proof.STRAIGHT): then no upper bound
        is known (Proof.NONE).
        """
        bounds = self
        for leaf in leaves:
            if leaf is not None:
                bounds = bounds._as_widely(leaf)._with_end(leaf)
        return bounds

    def _as_widely(self, leaf: Leaf) -> Bounds:
        if self.lower - NEAR_COST <= leaf.cost <= self.upper + NEAR_COST:
            return self
        lower = min(self.lower, leaf.cost)
        return replace(
            self, lower=lower, upper=inf, lower_proof=Proof.OUTER, upper_proof=Proof.NONE, complete=False, groups=()
        )

    def _with_end(self, leaf: Leaf) -> Bounds:
        """A cheaper or a more expensive end than those found; one at a bound proves it."""
        cost = leaf.cost
        cheaper, dearer = cost < self.least_found - NEAR_COST, cost > self.largest_found + NEAR_COST
        at_lower, at_upper = cheaper and cost <= self.lower + NEAR_COST, dearer and cost >= self.upper - NEAR_COST
        return replace(
            self,
            lower=cost if at_lower else self.lower,
            upper=cost if at_upper else self.upper,
            lower_proof=Proof.EXACT if at_lower else self.lower_proof,
            upper_proof=Proof.EXACT if at_upper else self.upper_proof,
            least_found=cost if cheaper else self.least_found,
            largest_found=cost if dearer else self.largest_found,
            cheapest=leaf if cheaper else self.cheapest,
            most_expensive=leaf if dearer else self.most_expensive,
            can_fail=self.can_fail or leaf.status is not RunStatus.DONE,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How much work may be spent on one strategy over one log.

    Attributes:
        segments: segments of the closed loop, each about one decision; up to twice as many where the most expensive
            run is nearly settled.
        segments_if_shortest: for strategies that plan shortest (strategy_traits.plans_shortest): about half of their
            states need not be followed, and their segments are fast; None for `segments`.
        finish: where fewer than this were needed, every world is followed to its end even though the bounds are
            settled: comparisons world by world need all ends.
        draws: segments for the estimate; when they are spent, fewer worlds are drawn.
        asked_again: how many decisions may be asked for again per segment, to show that they do not depend on what
            else open containers hold (same_decision.py).
        climb: segments for each climb towards the cheapest and the most expensive run, where no upper bound is known.
    """

    segments: int = 400
    segments_if_shortest: int | None = None
    finish: int = 150
    draws: int = 100
    climb: int = 60
    asked_again: int = 2

    def of(self, *, plans_shortest: bool) -> Budget:
        """The budget of one strategy, with its number of segments."""
        more = self.segments_if_shortest if plans_shortest else None
        return self if more is None else replace(self, segments=more, segments_if_shortest=None)


DEFAULT_BUDGET = Budget(segments_if_shortest=1500)
"""With this, both ends of nearly all deliveries of three are reached (docs/replay.md)."""


def budget_of(segments: int | None) -> Budget:
    """The budget with so many segments for every strategy; None for the default."""
    return DEFAULT_BUDGET if segments is None else Budget(segments=segments)
