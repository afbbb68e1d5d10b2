"""The parts of a run tree (run_tree.py): nodes, segments, unobserved looks and leaves."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from replayers.counterfactual.decisions.decided import Decided
from replayers.counterfactual.logged_world import Move, MoveToLook
from replayers.counterfactual.overlooked import PossibleContents
from replayers.counterfactual.relevance import Answer
from replayers.counterfactual.results import Assignment
from workbench.execution.events import RunStatus
from workbench.worlds.house import ContainerId, Item, ItemType
from workbench.worlds.knowledge import Knowledge


@dataclass(frozen=True, slots=True, kw_only=True)
class UnfinishedWalk:
    """A move of a robot that sees in passing, as far as it is known what came into view.

    Attributes:
        before: what the robot knows before it.
        move: where it goes, and what it seeks.
        contents_in_view: what containers that came into view hold beyond the log; the robot does not know it yet.
    """

    before: Knowledge
    move: Move
    contents_in_view: Mapping[ContainerId, tuple[Item, ...]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def key(self) -> Hashable:
        contents_in_view = tuple(
            (container, tuple(item.id for item in items)) for container, items in self.contents_in_view.items()
        )
        return self.move.target, None if self.move.seeking is None else tuple(self.move.seeking), contents_in_view


@dataclass(frozen=True, slots=True, kw_only=True)
class UnobservedLook:
    """A look into an open container: the log does not hold what it reveals.

    Attributes:
        container: the container being searched.
        live: the item types that still matter.
        options: the answers that it can give, the empty one first.
        others: whether it can give answers besides the options (relevance.MAX_ANSWERS).
        knowledge: what the robot knows before the look.
        possible: where looks may have missed, what it may hold beyond the log.
        walk: the move on which the container came into view; None where the robot looked into it.
    """

    container: ContainerId
    live: tuple[ItemType, ...]
    options: tuple[Answer, ...]
    others: bool
    knowledge: Knowledge
    possible: PossibleContents | None = None
    walk: UnfinishedWalk | None = None

    def allows(self, answer: Answer) -> bool:
        if self.possible is not None:
            return self.possible.allows(answer)
        return self.others or answer in self.options


@dataclass(frozen=True, slots=True, kw_only=True)
class PricedMove:
    """A move of a segment on which the robot may see a tag in passing, and the segment before it, as of Segment."""

    made: MoveToLook
    cost: float
    steps: int
    picks: int


@dataclass(frozen=True, slots=True)
class SegmentEnd:
    """How a run ended, and why."""

    status: RunStatus
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One segment of a run, from a node to the next unobserved look or to the end of the run.

    Attributes:
        cost: its cost, including the unobserved look.
        steps, picks: how many actions and picks it takes.
        unobserved: the look at which it stops; None at the end of the run.
        ended: how the run ended; None at an unobserved look.
        decided: the decisions in it.
        moves_to_look: its moves on which the robot may see a tag in passing; on none of them it does.
        without_events: it was run without events (tree/quick_segment.py): nothing in it is out of the ordinary.
    """

    cost: float
    steps: int
    picks: int
    unobserved: UnobservedLook | None
    ended: SegmentEnd | None
    decided: tuple[Decided, ...] = ()
    moves_to_look: tuple[PricedMove, ...] = ()
    without_events: bool = False

    @property
    def done(self) -> bool:
        return self.ended is not None and self.ended.status is RunStatus.DONE


@dataclass(slots=True, eq=False)
class Node:
    """A state of knowledge in the run tree. Steps, picks and cost count from the start, by the first path to it.

    imputed: an open container was searched on the way here, so that beliefs which depend on every observation are
    unknown from here on. certain: what RunTree.certain answers, once it was asked. sighted: the nodes after a tag was
    seen in passing in its segment, with the cost from here; None before anybody asked. walk: the move that the robot
    is on; knowledge then holds what it will have seen of the containers that came into view, from where it set out.
    ambiguous: its segment is that of one history; others that share the node may go on differently
    (decisions/needed_items.py).
    """

    knowledge: Knowledge
    walk: UnfinishedWalk | None = None
    imputed: bool = False
    steps: int = 0
    picks: int = 0
    cost: float = 0.0
    segment: Segment | None = None
    certain: bool | None = None
    ambiguous: bool = False
    children: dict[Answer, Node] = field(default_factory=dict)
    sighted: tuple[tuple[float, Node], ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaf:
    """The end of a run in all worlds that answer as `filled` says; cost is the charged cost."""

    filled: tuple[Assignment, ...]
    cost: float
    own_cost: float
    status: RunStatus


Choose = Callable[[UnobservedLook], Answer]
