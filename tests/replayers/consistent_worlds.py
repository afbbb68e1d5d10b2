"""Worlds that are consistent with a log, built from its messages without the replayer's own code, and runs in them.

Reads the MCAP file with the `mcap` library and derives by itself what docs/replay.md defines: which contents are
certain, which containers are open, and which item types are somewhere. A run in such a world is the ordinary closed
loop in the simulated world.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from mcap.reader import make_reader

from workbench.beliefs.estimators import estimator
from workbench.execution.events import ActionEnded, RunEnded
from workbench.execution.loop import LoopOptions, run_task
from workbench.log_schema.place import PLACE_ATTACHMENT, TASK_ATTACHMENT, Place, place_from_json, task_from_json
from workbench.planning.actions import relevant_types
from workbench.planning.strategies import strategy
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import ActionCosts
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, FloorPlan, House, Item, ItemId, ItemType, LocationId
from workbench.worlds.simulated import SimulatedWorld
from workbench.worlds.travel import Paths, TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, LookResult

MAX_STEPS = 500
"""Actions after which a run ends, as in a recorded one."""

DISTRACTORS = ("Vase", "Book", "Candle")
"""Item types that may lie about in any house."""

Imagined = Mapping[ContainerId, tuple[ItemType, ...]]
"""What open (and hidden) containers hold in a world, with repetitions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LogFacts:
    """What one log says of its place, task and run.

    Attributes:
        known: containers whose contents the robot knew before it started.
        certain: contents at the start of every container that was known or searched.
        shut, blocked, stuck: containers of which every search, locations to which every move, and items of which
            every pick was refused, with the reason.
        open: reachable containers that were neither observed nor refused.
        hidden: containers that are neither observed nor open; whatever is in them, no robot learns.
        ruled_out: item types that matter to the task and exist nowhere: the task lists the others.
        may_hold: item types that the other containers may hold, as far as worlds are built from them. What does not
            matter to the task, such as a television, may be there whatever the task lists.
        must_exist: types of which an instance is somewhere.
        truth: the recorded contents of the open and hidden containers; None if the log holds none.
    """

    place: Place
    task: Task
    costs: ActionCosts
    recorded_by: str
    estimator: str
    seed: int
    known: tuple[ContainerId, ...]
    certain: Mapping[ContainerId, tuple[Item, ...]]
    shut: Mapping[str, str]
    blocked: Mapping[str, str]
    stuck: Mapping[str, str]
    open: tuple[ContainerId, ...]
    hidden: tuple[ContainerId, ...]
    ruled_out: frozenset[ItemType]
    may_hold: tuple[ItemType, ...]
    must_exist: frozenset[ItemType]
    truth: Imagined | None

    def shown(self) -> frozenset[ItemType]:
        """Item types of which the log shows an instance."""
        return frozenset(item.type for items in self.certain.values() for item in items)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a run in a world ended, and the open containers that it searched, in order."""

    cost: float
    status: str
    searched: tuple[ContainerId, ...]


def read_facts(path: Path) -> LogFacts:
    """The facts of a log, from its attachments, metadata and messages alone."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        attached = {a.name: a.data for a in reader.iter_attachments()}
        info = next(m.metadata for m in reader.iter_metadata() if m.name == "lios.run")
        told: list[tuple[str, dict[str, Any]]] = [
            (channel.topic, json.loads(message.data))
            for _, channel, message in reader.iter_messages(
                topics=["/search/observation", "/search/action", "/search/truth"], log_time_order=False
            )
        ]
    place, task = place_from_json(attached[PLACE_ATTACHMENT]), task_from_json(attached[TASK_ATTACHMENT])
    costs = json.loads(attached["settings.json"])["costs"]
    certain, known = _certain(told)
    shut, blocked, stuck = _refusals(told)
    reachable = set(place.travel.locations)
    unseen = [c.id for c in place.plan.containers if c.id not in certain]
    open_ = tuple(c for c in unseen if LocationId(c) in reachable and c not in shut and c not in blocked)
    shown = {item.type for items in certain.values() for item in items}
    hidden = tuple(c for c in unseen if c not in open_)
    truth = _truth(told, (*open_, *hidden))
    mattering = frozenset(relevant_types(task.goal))
    ruled_out = mattering - {*task.available, *shown} if task.available else frozenset[ItemType]()
    anything = {*mattering, *task.available, *shown, *(ItemType(t) for t in DISTRACTORS)}
    anything |= {t for types in (truth or {}).values() for t in types}
    return LogFacts(
        place=place,
        task=task,
        costs=ActionCosts(search=costs["search"], manipulation=costs["manipulation"]),
        recorded_by=info["strategy"],
        estimator=info["estimator"],
        seed=int(info["seed"]),
        known=known,
        certain=certain,
        shut=shut,
        blocked=blocked,
        stuck=stuck,
        open=open_,
        hidden=hidden,
        ruled_out=ruled_out,
        may_hold=tuple(sorted(anything - ruled_out)),
        must_exist=frozenset(task.available),
        truth=truth,
    )


def is_consistent(facts: LogFacts, world: Imagined) -> bool:
    """Whether a world agrees with the log: contents only where nobody looked, every listed type somewhere, none
    that the task rules out."""
    held = {t for types in world.values() for t in types}
    return (
        set(world) <= {*facts.open, *facts.hidden}
        and not held & facts.ruled_out
        and facts.must_exist <= held | facts.shown()
    )


def run_in(facts: LogFacts, world: Imagined, strategy_name: str, *, name_ids: int = 0) -> Ended:
    """Runs a strategy in a world, with the log's seed, estimator and costs.

    Args:
        name_ids: varies the ids of items and their order in a container; no decision may depend on either.
    """
    inside: dict[ContainerId, tuple[Item, ...]] = dict(facts.certain)
    for container, types in world.items():
        numbered = Counter[ItemType]()
        items: list[Item] = []
        for t in types:
            numbered[t] += 1
            items.append(Item(id=ItemId(f"{t}|{name_ids}|{container}|{numbered[t]}"), type=t))
        inside[container] = tuple(items[name_ids % max(1, len(items)) :] + items[: name_ids % max(1, len(items))])
    house = House(plan=facts.place.plan, contents=inside)
    ways = _Ways(facts.place)
    events = list(
        run_task(
            RefusingWorld(
                SimulatedWorld(house, ways, known=facts.known),
                shut=facts.shut,
                blocked=facts.blocked,
                stuck=facts.stuck,
            ),
            strategy(strategy_name, origin=NameOrigin.USER),
            estimator(facts.estimator.partition("@")[0], origin=NameOrigin.USER),
            facts.task,
            costs=facts.costs,
            seed=facts.seed,
            options=LoopOptions(max_steps=MAX_STEPS, stopwatch=lambda: 0.0),
        )
    )
    ended = events[-1]
    assert isinstance(ended, RunEnded)
    looks = [e.step.target for e in events if isinstance(e, ActionEnded) and e.step.action == "search"]
    return Ended(
        cost=ended.cost,
        status=ended.status.value,
        searched=tuple(ContainerId(c) for c in looks if ContainerId(c) in facts.open),
    )


def random_world(facts: LogFacts, rng: np.random.Generator, *, extra: int) -> Imagined:
    """A consistent world: every listed type that the log does not show somewhere, and `extra` more items anywhere."""
    places = (*facts.open, *facts.hidden)
    inside: dict[ContainerId, list[ItemType]] = {c: [] for c in places}
    wanted = sorted(facts.must_exist - facts.shown())
    wanted += [facts.may_hold[int(rng.integers(len(facts.may_hold)))] for _ in range(extra)]
    for t in wanted if places else ():
        inside[places[int(rng.integers(len(places)))]].append(t)
    return {c: tuple(types) for c, types in inside.items()}


def world_around(facts: LogFacts, answers: Imagined) -> Imagined | None:
    """A consistent world in which open containers hold just these types, in the order of the run that searched them.

    Listed types that are in none of them are where the run did not look; where it looked everywhere, in the last
    container. Then None for an estimator whose beliefs would follow them.
    """
    left = [c for c in (*facts.hidden, *facts.open) if c not in answers]
    world = {**dict.fromkeys(left, ()), **answers}
    missing = sorted(facts.must_exist - facts.shown() - {t for types in answers.values() for t in types})
    if missing and not left and facts.estimator.startswith("best"):
        return None
    there = (left or list(answers))[0 if left else -1] if missing else None
    return world if there is None else {**world, there: (*world[there], *missing)}


def neighbour(
    facts: LogFacts, world: Imagined, last: Ended, relevant: Sequence[ItemType], rng: np.random.Generator, *, up: bool
) -> Imagined:
    """A consistent world that differs by one to three items moved, added or removed.

    Half of the moves are guided by the last run: upwards, items go from containers that were searched to others;
    downwards, to the first ones that were searched.
    """
    for _ in range(20):
        changed = {c: list(types) for c, types in world.items()}
        for _ in range(int(rng.integers(1, 4))):
            _change(facts, changed, last, relevant, rng, up=up)
        made = {c: tuple(types) for c, types in changed.items()}
        if is_consistent(facts, made):
            return made
    return world


def _change(
    facts: LogFacts,
    world: dict[ContainerId, list[ItemType]],
    last: Ended,
    relevant: Sequence[ItemType],
    rng: np.random.Generator,
    *,
    up: bool,
) -> None:
    kind = ("move", "move", "add", "remove")[int(rng.integers(4))]
    focus = [t for t in relevant if t in facts.may_hold] if rng.random() < 0.75 else []
    types = focus or list(facts.may_hold)
    if kind == "add":
        world[_target(world, last, rng, up=up)].append(types[int(rng.integers(len(types)))])
        return
    standing = [(c, t) for c, held in world.items() for t in held if not focus or t in focus]
    if up and rng.random() < 0.5:
        standing = [(c, t) for c, t in standing if c in last.searched] or standing
    if not standing:
        return
    container, item_type = standing[int(rng.integers(len(standing)))]
    world[container].remove(item_type)
    if kind == "move":
        world[_target(world, last, rng, up=up)].append(item_type)


def _target(world: Mapping[ContainerId, object], last: Ended, rng: np.random.Generator, *, up: bool) -> ContainerId:
    places = list(world)
    if rng.random() < 0.5:
        guided = [c for c in places if c not in last.searched] if up else list(last.searched[:3])
        places = guided or places
    return places[int(rng.integers(len(places)))]


def _certain(
    told: Sequence[tuple[str, dict[str, Any]]],
) -> tuple[dict[ContainerId, tuple[Item, ...]], tuple[ContainerId, ...]]:
    """Contents at the start: what the first look showed, without what the robot had carried there."""
    carried: set[str] = set()
    certain: dict[ContainerId, tuple[Item, ...]] = {}
    known: list[ContainerId] = []
    for topic, said in told:
        if topic == "/search/action" and said["action"] == "pick" and said["success"]:
            carried |= set(said["items"])
        if topic != "/search/observation" or said["container"] in certain:
            continue
        container = ContainerId(said["container"])
        there = [i for i in said["items"] if i["id"] not in carried]
        certain[container] = tuple(Item(id=ItemId(i["id"]), type=ItemType(i["type"])) for i in there)
        if said["known_at_start"]:
            known.append(container)
    return certain, tuple(known)


def _refusals(told: Sequence[tuple[str, dict[str, Any]]]) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
    """Searched containers, move targets and picked items that never worked, with the last reason."""
    failed: dict[tuple[str, str], str] = {}
    worked: set[tuple[str, str]] = set()
    for topic, said in told:
        if topic == "/search/action" and said["action"] in ("search", "move", "pick"):
            what = (said["action"], said["items"][0] if said["action"] == "pick" else said["target"])
            if said["success"]:
                worked.add(what)
            else:
                failed[what] = said["reason"]
    never = {what: why for what, why in failed.items() if what not in worked}
    shut, blocked, stuck = (
        {name: why for (action, name), why in never.items() if action == kind} for kind in ("search", "move", "pick")
    )
    return shut, blocked, stuck


def _truth(told: Sequence[tuple[str, dict[str, Any]]], places: Sequence[ContainerId]) -> Imagined | None:
    for topic, said in told:
        if topic == "/search/truth":
            inside = said["contents"]
            return {c: tuple(ItemType(i["type"]) for i in inside.get(c, ())) for c in places}
    return None


class _Ways:
    """The log's travel costs; ways are drawn as a single point, for no cost depends on them."""

    def __init__(self, place: Place) -> None:
        self._place = place

    @property
    def travel(self) -> TravelCosts:
        return self._place.travel

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        return ((0.0, 0.0),)

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self._place.standing.get(location)


class RefusingWorld:
    """A simulated world in which some searches, moves and picks are refused, each for a reason. Implements World."""

    def __init__(
        self,
        world: SimulatedWorld,
        *,
        shut: Mapping[str, str] = MappingProxyType({}),
        blocked: Mapping[str, str] = MappingProxyType({}),
        stuck: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._world = world
        self._shut, self._blocked, self._stuck = shut, blocked, stuck

    @property
    def plan(self) -> FloorPlan:
        return self._world.plan

    @property
    def travel(self) -> TravelCosts:
        return self._world.travel

    @property
    def paths(self) -> Paths:
        return self._world.paths

    def now_ns(self) -> int:
        return self._world.now_ns()

    def known_at_start(self) -> Mapping[ContainerId, tuple[Item, ...]]:
        return self._world.known_at_start()

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return self._world.seen_at_start()

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | ActionRefused:
        return self._refusal(self._blocked, location) or self._world.go_to(location, seeking=seeking)

    def look_into(self, container: ContainerId) -> LookResult | ActionRefused:
        return self._refusal(self._shut, container) or self._world.look_into(container)

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        return self._refusal(self._stuck, item) or self._world.pick(item)

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        return self._world.place(item)

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        return self._world.prepare(action, items)

    def _refusal(self, reasons: Mapping[str, str], name: str) -> ActionRefused | None:
        now = self.now_ns()
        return ActionRefused(start_ns=now, end_ns=now, reason=reasons[name]) if name in reasons else None
