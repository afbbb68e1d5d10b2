"""One simulated run: from house, task, strategy and seed to an MCAP file and its final event."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from recorders.run_identity import Driver, run_id, run_info
from recorders.run_recorder import RunRecorder
from recorders.sinks.files import Sink
from recorders.sinks.mirrored import ViewerFeed
from workbench.beliefs.memory.memory import Memory
from workbench.errors import BadValue, InputError, UnknownName
from workbench.execution.events import Event, RunEnded
from workbench.execution.loop import outcome_of
from workbench.execution.setup import RunSetup, set_up
from workbench.execution.start import MAX_KNOWN_SHARE, TaskStart, known_at_start, scenario_start
from workbench.log_schema.asking_json import estimator_to_settings
from workbench.log_schema.events import RunInfo
from workbench.log_schema.memory_json import memory_to_settings
from workbench.log_schema.perception_json import perception_to_settings
from workbench.log_schema.place import Place, place_to_json, task_to_json
from workbench.log_schema.sight_json import sight_to_settings
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Task, find_task
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.worlds.house import START, ContainerId, House, ItemType
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.perception import PERFECT, Perception, missing_at
from workbench.worlds.sight.lines_of_sight import checked_radius
from workbench.worlds.sight.sightings import SightPaths, sight_paths
from workbench.worlds.simulated import EPOCH_NS, NavigationPaths, SimulatedWorld


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One run to be made: the same trial gives the same events.

    Attributes:
        house: the truth, for the simulated world (and the oracle).
        known: containers whose contents the robot knows before it starts.
        strategy, estimator: names that a user gives; a strategy may be given itself.
        miss_rate: the chance that a look misses an item, in passing too, in [0, 1); the robot knows it.
        sees_m: how far the robot sees open furniture in passing, in metres; 0 for not at all.
        trusts_looks: the robot does not know the miss rate, and believes every look.
        memory: what the robot remembers of earlier runs.
        start_ns: when the run begins, in nanoseconds since the Unix epoch.
        paths: travel costs and paths, such as a site's; None to find them on the house's floor plan.

    Raises:
        BadValue: no sight radius, or sight together with other ways.
    """

    house: House
    task: Task
    strategy: str | Strategy
    estimator: str = "best"
    seed: int = 0
    known: tuple[ContainerId, ...] = ()
    costs: ActionCosts = SIMULATION_COSTS
    miss_rate: float = 0.0
    sees_m: float = 0.0
    trusts_looks: bool = False
    memory: Memory | None = None
    start_ns: int = EPOCH_NS
    paths: NavigationPaths | None = None

    def __post_init__(self) -> None:
        if checked_radius(self.sees_m) and self.paths is not None:
            raise BadValue("--sees", self.sees_m, "given for a house, not for a surveyed site")

    @property
    def perception(self) -> Perception:
        """How surely a look shows what is there, as the robot believes it."""
        return PERFECT if self.trusts_looks else missing_at(self.miss_rate)


class NotExactlyOneTask(InputError):
    """Not exactly one task was given."""

    def __init__(self, what: str) -> None:
        super().__init__(f"{what}. Give one of --find ITEM, --scenario NAME, --task FILE.")


@dataclass(frozen=True, slots=True, kw_only=True)
class RequestedTask:
    """A task as given by the user: exactly one of an item type to find, a scenario, or a task file.

    Raises:
        NotExactlyOneTask: none or more than one of them.
    """

    find: str = ""
    scenario: str = ""
    task_file: Path | None = None

    def __post_init__(self) -> None:
        given = [bool(self.find), bool(self.scenario), self.task_file is not None]
        if sum(given) != 1:
            what = "more than one task is given" if any(given) else "no task is given"
            raise NotExactlyOneTask(what)


def trial_for(
    request: RequestedTask,
    house: House,
    *,
    strategy: str | Strategy,
    estimator: str = "best",
    seed: int = 0,
    max_known: float | None = None,
    miss_rate: float = 0.0,
    paths: NavigationPaths | None = None,
) -> Trial:
    """The trial for a task request in a house.

    Args:
        max_known: largest share of containers known at the start; by default 0 for a find, and
            MAX_KNOWN_SHARE for a task.
        paths: travel costs and paths, such as a site's; None to find them on the house's floor plan.

    Raises:
        UnknownName: an unknown item type or scenario.
        Unsupported: a scenario that the house cannot support.
        BadValue: a miss rate outside [0, 1).
    """
    missing_at(miss_rate)
    if request.find:
        task = find_task(item_type_in(house, request.find), START)
        known = known_at_start(house.plan, rng=np.random.default_rng(seed), max_known=max_known or 0.0)
        start = TaskStart(house=house, task=task, known=known)
    else:
        start = scenario_start(
            request.scenario or str(request.task_file),
            house,
            seed=seed,
            travel=(paths or navigate(house.plan)).travel,
            max_known=MAX_KNOWN_SHARE if max_known is None else max_known,
        )
    return Trial(
        house=start.house,
        task=start.task,
        strategy=strategy,
        estimator=estimator,
        seed=seed,
        known=start.known,
        miss_rate=miss_rate,
        paths=paths,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _PreparedRun:
    setup: RunSetup
    world: SimulatedWorld
    place: Place

    def events(self) -> Iterator[Event]:
        return self.setup.events(self.world)


def trial_events(trial: Trial) -> Iterator[Event]:
    """Run a trial without recording it."""
    return _prepare(trial).events()


def record_trial(
    trial: Trial,
    path: Path,
    *,
    force: bool = False,
    sink: Sink | None = None,
    audience: ViewerFeed | None = None,
    begun: Callable[[], None] | None = None,
) -> RunEnded:
    """Run a trial and record it, including the ground truth.

    Args:
        sink: sink used in place of `path`, such as several files.
        audience: viewers that are shown every message once it is written.
        begun: called once after everything is loaded, before the first event.

    Raises:
        OutputExists: the file exists and `force` is false.
    """
    ready = _prepare(trial)
    info = _info(trial, ready)
    seen: list[Event] = []
    with RunRecorder(
        path,
        info=info,
        place=ready.place,
        task=trial.task,
        costs=trial.costs,
        truth=trial.house.contents,
        force=force,
        sink=sink,
        audience=audience,
        settings={
            **perception_to_settings(trial.perception),
            **sight_to_settings(trial.sees_m),
            **memory_to_settings(trial.memory),
            **estimator_to_settings(ready.setup.estimator),
        },
    ) as recorder:
        if begun is not None:
            begun()
        for event in ready.events():
            recorder.record(event)
            seen.append(event)
    return outcome_of(seen)


def item_type_in(house: House, name: str) -> ItemType:
    """The item type for a name as typed by a user, ignoring case and spacing.

    Raises:
        UnknownName: the house holds no such type; suggests similar names.
    """
    known = house.item_types()
    for item_type in known:
        if _plain(item_type) == _plain(name):
            return item_type
    raise UnknownName("item type", name, known, where=house.plan.name)


def _plain(name: str) -> str:
    return "".join(ch for ch in name.casefold() if ch.isalnum())


def _prepare(trial: Trial) -> _PreparedRun:
    navigation = trial.paths or navigate(trial.house.plan)
    setup = set_up(
        trial.task,
        strategy=trial.strategy,
        estimator=trial.estimator,
        costs=trial.costs,
        seed=trial.seed,
        house=trial.house,
        perception=trial.perception,
        memory=trial.memory,
    )
    return _PreparedRun(
        setup=setup,
        world=SimulatedWorld(
            trial.house,
            navigation,
            known=trial.known,
            miss_rate=trial.miss_rate,
            seed=trial.seed,
            passing=_sight(trial),
            start_ns=trial.start_ns,
        ),
        place=Place.of(trial.house.plan, navigation),
    )


def _sight(trial: Trial) -> SightPaths | None:
    if not trial.sees_m:
        return None
    navigation = navigate(trial.house.plan)
    return sight_paths(trial.house.plan, navigation.travel, navigation, trial.sees_m)


def _info(trial: Trial, ready: _PreparedRun) -> RunInfo:
    setup = ready.setup
    driver = Driver(strategy=setup.strategy.name, estimator=setup.estimator.name, seed=setup.seed)
    identity = (
        place_to_json(ready.place),
        task_to_json(trial.task),
        msgspec.json.encode([driver.strategy, driver.estimator, trial.seed, list(trial.known), trial.costs]),
        msgspec.json.encode({c: [i.id for i in items] for c, items in sorted(trial.house.contents.items())}),
        b"" if not trial.miss_rate else f"miss rate {trial.miss_rate!r}{', trusted' * trial.trusts_looks}".encode(),
        b"" if not trial.sees_m else f"sees {trial.sees_m!r}".encode(),
        b"" if trial.start_ns == EPOCH_NS else f"begins {trial.start_ns}".encode(),
    )
    return run_info(
        trial.task,
        driver,
        id=run_id(*identity),
        place=trial.house.plan.name,
        started_ns=ready.world.now_ns(),
    )
