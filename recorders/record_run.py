"""`recorders.record`: one simulated run of a named or given strategy, recorded to an MCAP file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from recorders.earlier_runs import move_rates, read_history
from recorders.simulated_run import RequestedTask, Trial, record_trial, trial_for
from recorders.sinks.files import Sink
from recorders.sinks.mirrored import ViewerFeed
from workbench.beliefs.memory.move_rates import NS_PER_DAY
from workbench.errors import BadValue, OutputExists
from workbench.evaluation.moved_house import moved_house
from workbench.evaluation.simulated_site import simulated_site, site_address
from workbench.execution.events import RunEnded
from workbench.planning.strategy import Strategy
from workbench.worlds.house import House
from workbench.worlds.house_yaml import is_house_yaml
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.assets import assets_for
from workbench.worlds.procthor.load import load_house
from workbench.worlds.simulated import EPOCH_NS, NavigationPaths

MOVED_SEED = 1
"""Keeps what moves apart from what else the seed draws."""
MAX_DAY = 36_500


def record(
    path: Path | str,
    *,
    house: House | str = "houses:0",
    find: str = "",
    scenario: str = "",
    task: Path | str | None = None,
    strategy: str | Strategy = "conditioned-lios",
    estimator: str = "best",
    seed: int = 0,
    known: float | None = None,
    miss_rate: float = 0.0,
    sees: float = 0.0,
    memory: Sequence[Path | str] = (),
    rates: Path | str | None = None,
    day: int | None = None,
    moved: float = 0.0,
    assets: Path | None = None,
    force: bool = False,
    sink: Sink | None = None,
    audience: ViewerFeed | None = None,
    begun: Callable[[Trial], None] | None = None,
) -> RunEnded:
    """Record one simulated run, given what `lios record` takes. The same arguments give the same bytes.

    Args:
        path: the MCAP file to write.
        house: "houses:9" (a shipped one), FILE:INDEX, a house's .json or .yaml, the survey of a site, or a house.
        find, scenario, task: exactly one.
        strategy: a name, "module:Class" from the working folder, or a strategy.
        estimator: a name, "module:Class" or a weights file.
        known: largest share of containers known at the start; None for 0 with `find`, else 0.2.
        miss_rate: chance that a look misses an item, drawn by the seed for each item and look; the robot knows it.
        sees: how far the robot sees open furniture in passing, in metres; 0 for not at all.
        memory, rates: logs of earlier runs, or folders of them; a table of lios learn-moves, or the shipped one.
        day: of the run, from 0; None for 0, or with `memory` for the first day after all that is remembered.
        moved: share of the house's items that stand elsewhere than in its file, drawn by the seed.
        assets: table of asset sizes; None takes the one beside the houses.
        sink: what is written to in place of `path`, such as several files.
        audience: viewers that are shown every message once it is written.
        begun: called with the trial once everything is loaded, before the first event.

    Returns:
        The run's last event: status, reason, cost, searches, travel_m.

    Raises:
        OutputExists: the file exists, and neither `force` nor `sink` is given.
        InputError: no such house, item type, scenario, strategy or estimator.
    """
    path = Path(path)
    if path.exists() and not force and sink is None:
        raise OutputExists(path)
    home, nav = _place(house, assets, moved, seed)
    job = RequestedTask(find=find, scenario=scenario, task_file=Path(task) if task is not None else None)
    trial = trial_for(
        job, home, strategy=strategy, estimator=estimator, seed=seed, max_known=known, miss_rate=miss_rate, paths=nav
    )
    trial = _with_memory(replace(trial, sees_m=sees), memory, rates, day)
    on_begun = None if begun is None else lambda: begun(trial)
    return record_trial(trial, path, force=force, sink=sink, audience=audience, begun=on_begun)


def _place(house: House | str, assets: Path | None, moved: float, seed: int) -> tuple[House, NavigationPaths | None]:
    """The house, after a share of its items has moved; and, of a site, its navigation."""
    navigation: NavigationPaths | None = None
    measured = isinstance(house, House) or is_house_yaml(house) or site_address(house) is not None
    if measured and assets is not None:
        raise BadValue("--assets", str(assets), "left out: the sizes are ProcTHOR's, and this place has its own")
    if isinstance(house, House):
        place = house
    elif (site := site_address(house)) is not None:
        simulated = simulated_site(*site, seed=seed)
        place, navigation = simulated.house, simulated.navigation
    else:
        place = load_house(house, assets=assets_for(house, assets))
    if not moved:
        return place, navigation
    travel = (navigation or navigate(place.plan)).travel
    return moved_house(place, travel, moved, rng=np.random.default_rng((seed, MOVED_SEED))), navigation


def _with_memory(trial: Trial, logs: Sequence[Path | str], rates: Path | str | None, day: int | None) -> Trial:
    """The trial on its day, with what its robot remembers then."""
    if day is not None and not 0 <= day <= MAX_DAY:
        raise BadValue("day of the run", day, f"between 0 and {MAX_DAY}")
    if not logs:
        if rates is not None:
            raise BadValue("move rates", str(rates), "given together with --memory")
        return replace(trial, start_ns=EPOCH_NS + NS_PER_DAY * (day or 0))
    history = read_history([Path(log) for log in logs], trial.house.plan)
    start_ns = history.next_day_ns(EPOCH_NS) if day is None else EPOCH_NS + NS_PER_DAY * day
    memory = history.memory_at(start_ns, trial.house.plan, move_rates(None if rates is None else Path(rates)))
    return replace(trial, memory=memory, start_ns=start_ns)
