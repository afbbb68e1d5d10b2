"""What in an unopened container can change what a run costs? Only the item types of the task, up to their demand.

Two worlds that agree on the *answers* of their open containers give every strategy the same run, if the strategy
keeps the contract of docs/replay.md. An answer is a sorted tuple of item types with repetitions: which relevant
types lie there, each at most as often as the task can use it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

from replayers.evidence import Evidence
from workbench.execution.goal_check import is_met
from workbench.planning.actions import relevant_types
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Task
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge

Answer = tuple[ItemType, ...]
"""What an open container holds of what matters: sorted item types, with repetitions. () is nothing."""

NOTHING: Answer = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumptions:
    """What is taken for granted beyond the log.

    Attributes:
        inventory: the task's list of available item types is right: each is somewhere, and no other is (the
            paper's prior knowledge, Sec. III). Without effect where the task lists none.
        unique: there is no instance of a type beyond those that the log shows, where it shows one (an operator
            who laid out marked objects knows that).
    """

    inventory: bool = True
    unique: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Relevance:
    """What matters in the open containers of one log for one task.

    Attributes:
        types: relevant item types that an open container may hold, sorted.
        most: how many instances of each the task can use.
        must_exist: types of which an instance is somewhere.
        hidden: whether some container can hold things that no robot can see (unreachable, or refusing).
        finishing: types that stop mattering once the goal's parts that name them are met.
    """

    types: tuple[ItemType, ...]
    most: Mapping[ItemType, int]
    must_exist: frozenset[ItemType]
    hidden: bool
    finishing: Mapping[ItemType, Goal]
    unique: bool = False

    def live(self, knowledge: Knowledge) -> tuple[ItemType, ...]:
        """The types that still matter, given what has been done."""
        return tuple(t for t in self.types if not (t in self.finishing and is_met(self.finishing[t], knowledge)))

    def options(
        self,
        live: tuple[ItemType, ...],
        *,
        found_before: frozenset[ItemType],
        open_left: int,
        seen: frozenset[ItemType],
    ) -> tuple[Answer, ...]:
        """All answers that an open container can give, nothing first.

        Args:
            live: the types that still matter.
            found_before: types that open containers held before.
            open_left: how many open containers are left besides this one.
            seen: types of which the log shows an instance.
        """
        before = found_before
        counts: list[range] = []
        for t in live:
            most = 0 if self.unique and (t in seen or t in before) else self.most[t]
            last_chance = open_left == 0 and not self.hidden and t in self.must_exist
            least = 1 if last_chance and t not in seen and t not in before else 0
            counts.append(range(least, max(most, least) + 1))
        answers = (tuple(t for t, n in zip(live, ns, strict=True) for _ in range(n)) for ns in product(*counts))
        return tuple(sorted(answers, key=lambda a: (len(a), a)))


def relevance_of(evidence: Evidence, asked: Iterable[ItemType], assumptions: Assumptions) -> Relevance:
    """What matters over a log.

    Args:
        asked: the types about which a strategy wants beliefs; the goal's own always matter.
    """
    task = evidence.task
    wanted = set(relevant_types(task.goal)) | set(asked)
    listed = frozenset(task.available) if assumptions.inventory else frozenset[ItemType]()
    seen = evidence.seen_types()
    types = tuple(sorted(wanted & (listed | seen) if listed else wanted))
    if assumptions.unique:
        types = tuple(t for t in types if t not in seen)
    most = most_instances(task.goal)
    looked = set(evidence.contents) | set(evidence.open)
    return Relevance(
        types=types,
        most=MappingProxyType({t: max(1, _named(task).get(t, most)) for t in types}),
        must_exist=frozenset(t for t in types if t in listed),
        hidden=any(c.id not in looked for c in evidence.place.plan.containers),
        finishing=MappingProxyType(_finishing(task.goal, types)),
        unique=assumptions.unique,
    )


def most_instances(goal: Goal) -> int:
    """How many parts of a goal can be worked on together: no type is used by more instances than this."""
    if isinstance(goal, AllOf):
        return sum(most_instances(part) for part in goal.parts)
    if isinstance(goal, AnyOf):
        return max((most_instances(part) for part in goal.parts), default=0)
    return 1


def imputed_items(answer: Answer, container: ContainerId) -> tuple[Item, ...]:
    """The instances that an answer stands for, with ids that say so."""
    counted: Counter[ItemType] = Counter()
    items: list[Item] = []
    for t in answer:
        counted[t] += 1
        items.append(Item(id=ItemId(f"{t}|imputed|{container}|{counted[t]}"), type=t))
    return tuple(items)


def _named(task: Task) -> dict[ItemType, int]:
    """For types that only the goal itself names (no preparation uses them): how many instances it can use."""
    counts = _leaves(task.goal)
    tools = set(relevant_types(task.goal)) - set(counts)
    return counts if not tools else {}


def _leaves(goal: Goal) -> dict[ItemType, int]:
    if isinstance(goal, AllOf):
        total: Counter[ItemType] = Counter()
        for part in goal.parts:
            total.update(_leaves(part))
        return dict(total)
    if isinstance(goal, AnyOf):
        most: dict[ItemType, int] = {}
        for part in goal.parts:
            for t, n in _leaves(part).items():
                most[t] = max(most.get(t, 0), n)
        return most
    return {goal.item_type: 1}


def _finishing(goal: Goal, types: tuple[ItemType, ...]) -> dict[ItemType, Goal]:
    """For plain deliveries, the parts of the goal that a type serves: once they are met, it matters no more."""
    parts = goal.parts if isinstance(goal, AllOf) else (goal,)
    if not all(isinstance(part, Delivered) and not part.properties for part in parts):
        return {}
    named = {t: tuple(p for p in parts if isinstance(p, Delivered) and p.item_type == t) for t in types}
    return {t: AllOf(parts=mine) for t, mine in named.items() if mine}
