"""What is known of a strategy and its estimator, by which a tree of runs is kept small."""

from __future__ import annotations

from dataclasses import dataclass

from replayers.counterfactual.durations import SIMULATED, Durations
from replayers.counterfactual.strategy_traits import UNKNOWN, SearchTraits
from workbench.planning.composed import Composed
from workbench.search.policy import SearchPolicy

MAX_STEPS = 500
"""As the closed loop's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeOptions:
    """What is known of a strategy and its estimator, by which a tree is kept small, and how its runs are made.

    Attributes:
        seed: passed to the strategy with every view.
        max_steps: actions after which a run ends.
        merge: histories with the same knowledge of what still matters share a node. Right for strategies that
            decide by that knowledge alone; the built-in ones do (tests hold them to it).
        static_beliefs: the estimator uses names alone; otherwise all that was found distinguishes histories.
        exact_beliefs: the estimator answers what the robot believed; with rounded beliefs (logged_belief.ROUNDED)
            nothing that was decided by them is certain, from the start on.
        reads_beliefs: the strategy's decisions depend on beliefs.
        looks_by: of a strategy whose plans go by distance alone: the policy by which it looks.
        parts: of a strategy whose plans go by find costs of each type alone: what it is made of.
        made_of: of a built-in strategy that is composed: the strategy itself, with its explanations.
        asked_again: how often it is asked again what it would do had the open containers held something else
            (same_decision.py).
        traits: what is known of its runs, for bounds.
        durations: how long actions take where a run is replayed.
        as_driven: the strategy drove the run, and the tree is that run alone: what was seen by chance is seen again.
    """

    seed: int = 0
    max_steps: int = MAX_STEPS
    merge: bool = False
    static_beliefs: bool = True
    exact_beliefs: bool = True
    reads_beliefs: bool = True
    looks_by: SearchPolicy | None = None
    parts: Composed | None = None
    made_of: Composed | None = None
    asked_again: int = 0
    traits: SearchTraits = UNKNOWN
    durations: Durations = SIMULATED
    as_driven: bool = False


def zero_clock() -> float:
    """A clock that stands still: planning time is not charged in a replay, since it depends on the machine."""
    return 0.0
