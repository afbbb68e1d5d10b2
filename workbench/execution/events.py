"""The events of a run, as yielded by the execution loop in domain types.

Every event has a stamp in nanoseconds since the Unix epoch and the number of the decision that it belongs to:
decision 0 covers everything before the first plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.belief import Belief
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import Decision
from workbench.search.find_costs import FindCosts
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId


class RunStatus(StrEnum):
    """How a run ended."""

    DONE = "done"
    NO_PLAN = "no-plan"
    """Proven: the goal can no longer be met, and no unsearched container could help."""
    MIN_REMAINING_PROBABILITY = "nothing-left-to-search"
    OUT_OF_BUDGET = "out-of-planning-budget"
    PLANNER_FAILED = "planner-failed"
    """The strategy raised an exception, hung, or returned an illegal action."""
    UNDETERMINED = "undetermined"
    """Replay only: the log lacks an observation that the run needs."""
    NOT_REPRODUCED = "not-reproduced"
    """Replay only: the strategy that drove the run does not do what was recorded, so nothing is claimed of any."""
    ABORTED = "aborted"
    """The run was stopped by an operator or a robot fault."""
    STEP_LIMIT = "step-limit"
    ESTIMATOR_FAILED = "estimator-failed"
    """The estimator raised an exception, hung, or gave no belief."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookMade:
    """How one look was made.

    Attributes:
        number: which look into this container it is, from 1.
        viewpoint: where the robot stood; None where that is not known.
        in_view: the containers that were in view.
        duration_s: how long it looked.
        detector: what detected; empty where it has no name.
        p_detect: per item type that matters to the task, the chance that the look detects it where it is.
        source: where these come from: assumed, calibrated, site.
    """

    number: int
    viewpoint: Pose | None
    in_view: tuple[ContainerId, ...]
    duration_s: float
    detector: str
    p_detect: tuple[tuple[ItemType, float], ...]
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerObserved:
    """The contents of a container became known; `known_at_start` if before the run began.

    `opened_by` says who opened closed furniture for the look; "" where nothing had to be opened or it is not known.
    `look` says how it was looked, where looks can miss; None where they show everything. `passing_from` is where the
    robot was as it saw an open container in passing; None where it looked into one.
    """

    stamp_ns: int
    decision: int
    container: ContainerId
    items: tuple[Item, ...]
    robot_at: LocationId
    known_at_start: bool = False
    support: str = ""
    opened_by: str = ""
    look: LookMade | None = None
    passing_from: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemSighted:
    """An item was seen in a container in passing, from a viewpoint on the way that began at robot_at.

    What else the container holds was not seen.
    """

    stamp_ns: int
    decision: int
    container: ContainerId
    item: Item
    robot_at: LocationId
    viewpoint: Pose
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorAnswered:
    """What an estimator asked and was answered, once a run; seconds are those of when it was asked."""

    stamp_ns: int
    decision: int
    answer: Answer


@dataclass(frozen=True, slots=True, kw_only=True)
class BeliefUpdated:
    """The estimator's belief at a decision."""

    stamp_ns: int
    decision: int
    belief: Belief


@dataclass(frozen=True, slots=True, kw_only=True)
class FindCostsUpdated:
    """The find costs that a decision was planned with."""

    stamp_ns: int
    decision: int
    find_costs: FindCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanMade:
    """A decision: the plan, the reason for replanning, and the wall-clock time of each phase in seconds."""

    stamp_ns: int
    decision: int
    robot_at: LocationId
    reason: str
    made: Decision
    belief_s: float
    planning_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionEnded:
    """An action ended; `cost` is 0 if it was refused before it began (`success` is then false).

    `item_remains` says of a failed pick that the item is still where it was.
    """

    stamp_ns: int
    decision: int
    index: int
    start_ns: int
    step: PlanStep
    cost: float
    success: bool
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    standing: Pose | None = None
    items: tuple[ItemId, ...] = ()
    reason: str = ""
    support: str = ""
    item_remains: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEnded:
    """The run ended. `cost` is the charged cost: own_cost if done, the task's failure cost otherwise."""

    stamp_ns: int
    decision: int
    status: RunStatus
    cost: float
    own_cost: float
    reason: str
    searches: int
    travel_m: float
    unseen: ContainerId | None = None


Event = (
    ContainerObserved
    | ItemSighted
    | EstimatorAnswered
    | BeliefUpdated
    | FindCostsUpdated
    | PlanMade
    | ActionEnded
    | RunEnded
)
