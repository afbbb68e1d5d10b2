"""The vocabulary of a log: one frozen class for each topic, written and checked by msgspec, with its JSON Schema.

Wire names are listed in docs/log-format.md; stamps are {"sec", "nsec"}. A change of meaning bumps SCHEMA_VERSION and
brings a reader for the old one.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeVar

import msgspec

SCHEMA_VERSION = 3
"""1: a plan that was not found expected a cost of 0.0. 2: it expects none (null). 3: beliefs are not rounded."""

ROUNDED_BEFORE = 3
"""Logs of an older schema version hold beliefs rounded to six decimals."""

NANO = 1_000_000_000


class Stamp(msgspec.Struct, frozen=True, order=True):
    """Nanoseconds since the Unix epoch in Foxglove's JSON form."""

    sec: int
    nsec: int

    @classmethod
    def of(cls, stamp_ns: int) -> Stamp:
        return cls(stamp_ns // NANO, stamp_ns % NANO)

    @property
    def ns(self) -> int:
        return self.sec * NANO + self.nsec


class SeenItem(msgspec.Struct, frozen=True):
    id: str
    type: str


class HowLooked(msgspec.Struct, frozen=True, kw_only=True):
    """How a look was made that can miss.

    p_detect[i]: the chance that it detects item_types[i] where it is; source says where that comes from: assumed,
    calibrated, site. viewpoint is x and y in metres and the heading in radians, empty where it is not known.
    """

    number: int
    viewpoint: tuple[float, ...] = ()
    in_view: tuple[str, ...] = ()
    duration_s: float = 0.0
    detector: str = ""
    item_types: tuple[str, ...] = ()
    p_detect: tuple[float, ...] = ()
    source: str = "assumed"

    def __post_init__(self) -> None:
        if len(self.p_detect) != len(self.item_types):
            raise ValueError(f"p_detect is not of {len(self.item_types)} item types")
        if not all(0 < p <= 1 for p in self.p_detect):
            raise ValueError("p_detect is not above 0 and at most 1")


class SeenInPassing(msgspec.Struct, frozen=True, kw_only=True):
    """How an open container was seen that the robot passed; viewpoint is x and y in metres and the heading in
    radians."""

    how: str = "in passing"
    viewpoint: tuple[float, ...] = ()


class Observation(msgspec.Struct, frozen=True, kw_only=True):
    """A container's content became known.

    opened_by says who opened closed furniture for the look; look is None (left out) where looks show everything;
    passing is None (left out) where the robot looked into the container. robot_at is where the robot was, or, in
    passing, where it came from.
    """

    stamp: Stamp
    decision: int
    container: str
    items: tuple[SeenItem, ...]
    robot_at: str
    known_at_start: bool = False
    support: str = ""
    opened_by: str = ""
    look: HowLooked | None = None
    passing: SeenInPassing | None = None


class ItemSighting(msgspec.Struct, frozen=True, kw_only=True):
    """An item was seen in a container that the robot passed; what else the container holds was not seen.

    robot_at is where the way began; viewpoint is x and y in metres and the heading in radians.
    """

    stamp: Stamp
    decision: int
    container: str
    item: SeenItem
    robot_at: str
    viewpoint: tuple[float, ...] = ()
    support: str = ""


class BeliefUpdate(msgspec.Struct, frozen=True, kw_only=True):
    """probability[i][j]: item_types[i] in containers[j]; within [0, 1], as it was believed (ROUNDED_BEFORE)."""

    stamp: Stamp
    decision: int
    item_types: tuple[str, ...]
    containers: tuple[str, ...]
    probability: tuple[tuple[float, ...], ...]
    estimator: str

    def __post_init__(self) -> None:
        rows, columns = len(self.item_types), len(self.containers)
        if len(self.probability) != rows or any(len(row) != columns for row in self.probability):
            raise ValueError(f"probability is not of {rows} item types in {columns} containers")


class EstimatorAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """What an estimator asked and was answered (a language model, say), before the belief that rests on it; each
    question once a run. seconds: how long the answer took when it was asked for."""

    stamp: Stamp
    decision: int
    estimator: str
    model: str
    question: str
    answer: str
    seconds: float = 0.0


class FindCosts(msgspec.Struct, frozen=True, kw_only=True):
    """metres[i][j][k]: finding item_types[i] from origins[j], carried to targets[k]."""

    stamp: Stamp
    decision: int
    item_types: tuple[str, ...]
    origins: tuple[str, ...]
    targets: tuple[str, ...]
    metres: tuple[tuple[tuple[float, ...], ...], ...]
    kind: str
    belief_model: str

    def __post_init__(self) -> None:
        rows, origins, targets = len(self.item_types), len(self.origins), len(self.targets)
        fits = len(self.metres) == rows and all(
            len(table) == origins and all(len(row) == targets for row in table) for table in self.metres
        )
        if not fits:
            raise ValueError(f"metres is not of {rows} item types from {origins} origins to {targets} targets")


class Step(msgspec.Struct, frozen=True, kw_only=True):
    action: str
    origin: str
    target: str
    item_types: tuple[str, ...] = ()
    items: tuple[str, ...] = ()
    cost: float = 0.0


class Stop(msgspec.Struct, frozen=True, kw_only=True):
    """A container in the order in which the search policy intends to look."""

    container: str
    probability: float
    reached: float
    leg_m: float


class WayNotTaken(msgspec.Struct, frozen=True, kw_only=True):
    title: str
    cost: float
    why_not: str = ""


class PlanComputed(msgspec.Struct, frozen=True, kw_only=True):
    """expected_cost is of the whole plan; None where status says that there is none."""

    stamp: Stamp
    decision: int
    robot_at: str
    reason: str
    status: str
    steps: tuple[Step, ...]
    expected_cost: float | None = None
    lower_bound: float | None = None
    optimal: bool
    solver: str
    note: str = ""
    search_order: tuple[Stop, ...] = ()
    alternatives: tuple[WayNotTaken, ...] = ()
    look_on_the_way: tuple[str, ...] = ()
    """Containers to look into before the first step, while passing them."""


class Timing(msgspec.Struct, frozen=True, kw_only=True):
    """Wall-clock seconds of a decision; apart from the others, so that the same seed gives the same bytes."""

    stamp: Stamp
    decision: int
    belief_s: float
    planning_s: float


class ActionFinished(msgspec.Struct, frozen=True, kw_only=True):
    """stamp is the end. path holds the corner points (x, y) walked, in the map frame, metres.

    item_remains: a pick that failed although the item is still there.
    """

    stamp: Stamp
    decision: int
    index: int
    start: Stamp
    action: str
    origin: str
    target: str
    item_types: tuple[str, ...]
    items: tuple[str, ...]
    cost: float
    success: bool
    travel_m: float = 0.0
    path: tuple[tuple[float, float], ...] = ()
    reason: str = ""
    support: str = ""
    item_remains: bool = False


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """cost is what is charged: own_cost when done, the failure cost otherwise."""

    stamp: Stamp
    decision: int
    status: str
    cost: float
    own_cost: float
    reason: str
    searches: int
    travel_m: float
    unseen: str | None = None


class GroundTruth(msgspec.Struct, frozen=True, kw_only=True):
    """What every container held at the start; simulation only, hidden by readers unless asked."""

    stamp: Stamp
    contents: dict[str, tuple[SeenItem, ...]]


class Dropped(msgspec.Struct, frozen=True, kw_only=True):
    """Messages that the recorder had to drop since the file began, by topic, because writing could not keep up."""

    stamp: Stamp
    counts: dict[str, int]


class RunInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Metadata record `lios.run`, every value printed as text in MCAP."""

    run_id: str
    schema_version: int
    place: str
    scenario: str
    strategy: str
    estimator: str
    seed: int
    started: Stamp
    title: str = ""
    source: str = "simulation"
    """simulation, spot, import, or replay."""
    origin_run: str = ""
    """For a replay: the run id of the source log. For a run that goes on from an interrupted one: its run id."""
    origin_sha256: str = ""
    code_version: str = ""
    code_revision: str = ""
    code_dirty: bool = False
    weights_sha256: str = ""
    inertial_frame: str = ""


DomainEvent = (
    Observation
    | ItemSighting
    | EstimatorAnswer
    | BeliefUpdate
    | FindCosts
    | PlanComputed
    | Timing
    | ActionFinished
    | Outcome
    | GroundTruth
    | Dropped
)

TRUTH_TOPIC = "/search/truth"
POSE_TOPIC = "/robot/pose"
"""Viewer topic of the robot's pose (foxglove.PoseInFrame), which tables read beside the vocabulary."""

TOPICS: Mapping[str, type[msgspec.Struct]] = MappingProxyType(
    {
        "/search/observation": Observation,
        "/search/sighting": ItemSighting,
        "/search/answer": EstimatorAnswer,
        "/search/belief": BeliefUpdate,
        "/search/find_cost": FindCosts,
        "/search/plan": PlanComputed,
        "/search/timing": Timing,
        "/search/action": ActionFinished,
        "/search/outcome": Outcome,
        TRUTH_TOPIC: GroundTruth,
        "/recorder/dropped": Dropped,
    }
)
"""Event classes by topic. The schema's name is "lios." and the class's name."""

Wire = TypeVar("Wire", bound=msgspec.Struct)
"""A class of the vocabulary."""

TOPIC_OF: Mapping[type[msgspec.Struct], str] = MappingProxyType({cls: topic for topic, cls in TOPICS.items()})

REPEATABLE = tuple(t for t in TOPICS if t not in ("/search/timing", "/search/answer", "/recorder/dropped"))
"""Topics whose bytes are the same for the same seed."""


def schema_name(event_class: type[msgspec.Struct]) -> str:
    """ "lios.Observation" for Observation."""
    return f"lios.{event_class.__name__}"
