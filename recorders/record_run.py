"""`recorders.record`: one simulated run of a named or given strategy, recorded to an MCAP file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from recorders.simulated_run import TaskRequest, Trial, record_trial, trial_for
from recorders.sinks.files import Sink
from recorders.sinks.mirrored import Audience
from workbench.errors import OutputExists
from workbench.execution.events import RunEnded
from workbench.planning.strategy import Strategy
from workbench.worlds.house import House
from workbench.worlds.procthor.assets import assets_for
from workbench.worlds.procthor.load import load_house


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
    assets: Path | None = None,
    force: bool = False,
    sink: Sink | None = None,
    audience: Audience | None = None,
    begun: Callable[[Trial], None] | None = None,
) -> RunEnded:
    """Record one simulated run. The same arguments give the same bytes.

    It takes what `lios record` takes, which is more than eight parameters, all but the path by keyword.

    Args:
        path: the MCAP file to write.
        house: "houses:9" (a shipped one), FILE:INDEX, a house's .json, or a house.
        find, scenario, task: exactly one of an item type, a scenario's name and a task file.
        strategy: a name, "module:Class" from the working folder, or a strategy.
        estimator: a name, "module:Class" or a weights file.
        known: largest share of containers known at the start; None for 0 with `find`, else 0.2.
        miss_rate: chance that a look misses an item, drawn by the seed for each item and look; the robot knows it.
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
    place = house if isinstance(house, House) else load_house(house, assets=assets_for(house, assets))
    wish = TaskRequest(find=find, scenario=scenario, task_file=Path(task) if task is not None else None)
    trial = trial_for(
        wish, place, strategy=strategy, estimator=estimator, seed=seed, most_known=known, miss_rate=miss_rate
    )
    told = None if begun is None else lambda: begun(trial)
    return record_trial(trial, path, force=force, sink=sink, audience=audience, begun=told)
