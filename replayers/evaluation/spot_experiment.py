"""The paper's configurations A to D, run on a simulated Spot, recorded and replayed.

The robot's time is stepped: it passes only while the robot walks, looks and handles things, so a run takes a few
seconds, planning takes no robot time, and the same seed gives the same run. Each log is then replayed for the other
strategies, whose real runs are known: do their costs lie within the bounds?
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from replayers.counterfactual.estimates.intervals import finite
from workbench.evaluation.failed_estimator import require_beliefs
from workbench.evaluation.tasks.experiment import PAPER_STRATEGIES
from workbench.log_schema.events import ActionFinished
from workbench.log_schema.tags_in_passing_json import tags_from_settings
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import ROBOT_COSTS
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.sight.sightings import stop_point
from workbench.worlds.sight.tags_in_passing import TagsInPassing
from workbench.worlds.sites.configurations import Configuration, configurations_of, site_and_house
from workbench.worlds.sites.site import Site

if TYPE_CHECKING:
    from recorders.spot.session.session import Rates
    from replayers.runs.run import Run

STRATEGIES = ("pes-greedy", "pes-lios", "model-lios", "conditioned-lios")
"""The paper's three and ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpotExperiment:
    """The settings of the experiment.

    Attributes:
        folder: where the logs are written, as "spot_A_model-lios.mcap" and so on.
        estimator: estimator of our strategies and plug-ins; paper_estimator: of the paper's strategies.
        images_hz: pictures per second; the shipped logs have few.
        raw: also log bosdyn's messages as received, and a depth camera, which viewers show from those.
        sees_m: how far tags count that are seen in passing; 0 for not at all, as in the paper.
        miss_rate: what the robot's detector misses from nearby (MissedTags); None for nothing that is in view.
    """

    site: Site
    task: Task
    folder: Path
    configurations: tuple[str, ...] = ("A", "B", "C", "D")
    strategies: tuple[str, ...] = STRATEGIES
    estimator: str = "best"
    paper_estimator: str = "fcnn"
    seed: int = 0
    images_hz: float = 0.03
    raw: bool = True
    sees_m: float = 0.0
    miss_rate: float | None = None
    force: bool = False

    def estimator_of(self, strategy: str) -> str:
        """The estimator whose beliefs a strategy uses."""
        return self.paper_estimator if strategy in PAPER_STRATEGIES else self.estimator


@dataclass(frozen=True, slots=True, kw_only=True)
class SpotRow:
    """One run of the experiment.

    Attributes:
        estimator: the estimator whose beliefs the strategy used.
        paper_seconds, paper_searches: what the paper reports for this cell, where it does.
    """

    configuration: str
    strategy: str
    status: str
    seconds: float
    searches: int
    cost: float
    travel_m: float
    estimator: str
    log: Path
    paper_seconds: float | None = None
    paper_searches: int | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossRow:
    """One strategy replayed over another's log: its bounds (an upper of None is none), and what its own run cost
    (cost_by_the_matrix)."""

    configuration: str
    log_strategy: str
    strategy: str
    lower: float
    upper: float | None
    exact: bool
    estimate: float | None
    ran: float
    inside: bool = field(default=False)


def run_experiment(experiment: SpotExperiment) -> Iterator[SpotRow]:
    """Runs every configuration with every strategy; yields the rows as they are finished.

    Raises:
        MissingExtra: bosdyn-client is not installed. UnknownName: a configuration that is not there.
        OutputExists: a log is there and force is not set.
    """
    known = configurations_of(experiment.site)
    chosen = [_named(known, name, experiment.site) for name in experiment.configurations]
    experiment.folder.mkdir(parents=True, exist_ok=True)
    for configuration in chosen:
        for strategy in experiment.strategies:
            yield _run_one(experiment, configuration, strategy)


def cross_replay(rows: Sequence[SpotRow], *, worlds: int = 0) -> Iterator[CrossRow]:
    """Replays each run's strategy, with its estimator, over the logs of the others in its configuration."""
    from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_on
    from replayers.runs.run import read

    priced = {(row.configuration, row.strategy): cost_by_the_matrix(read(row.log)) for row in rows}
    for row in rows:
        others = [o for o in rows if o.configuration == row.configuration and o.strategy != row.strategy]
        if not others:
            continue
        run = read(row.log)
        grounds = {
            name: prepare_log(run, ReplaySettings(worlds=worlds, estimator=name, estimator_origin=NameOrigin.USER))
            for name in sorted({o.estimator for o in others})
        }
        for other in others:
            replayed = replay_on(grounds[other.estimator], other.strategy, origin=NameOrigin.USER)
            if replayed.bounds is None:
                continue
            lower, upper = replayed.bounds.lower, replayed.bounds.upper
            yield CrossRow(
                configuration=row.configuration,
                log_strategy=row.strategy,
                strategy=other.strategy,
                lower=lower,
                upper=finite(upper),
                exact=replayed.exact,
                estimate=None if replayed.estimate is None else replayed.estimate.mean,
                ran=priced[other.configuration, other.strategy],
                inside=lower - NEAR_COST <= priced[other.configuration, other.strategy] <= upper + NEAR_COST,
            )


def cost_by_the_matrix(run: Run) -> float:
    """The cost of a recorded run with its moves at the site's travel costs, as a replay counts them.

    The robot itself walks a little less: it cuts the corners of the grid.
    """
    outcome = run.outcome
    if outcome is None or outcome.status != "done":
        return outcome.cost if outcome is not None else 0.0
    tags = tags_from_settings(run.settings, run.place)
    total = 0.0
    for action in run.actions:
        total += _by_the_matrix(run, tags, action) if action.action == "move" and action.success else action.cost
    return total


def _by_the_matrix(run: Run, tags: TagsInPassing | None, move: ActionFinished) -> float:
    """The metres of a move by the travel costs, also of one that ended or began at a turn on the way."""
    origin, target = LocationId(move.origin), LocationId(move.target)
    if tags is None or stop_point(target) is None:
        travel = run.place.travel if tags is None else tags.travel_from(origin)
        return travel.between(origin, target) or 0.0
    points = (
        point
        for plan in run.plans
        if plan.decision == move.decision and plan.search_order
        for seen in run.sightings
        if seen.decision == move.decision
        for point in tags.turning_points(
            origin, LocationId(plan.search_order[0].container), ContainerId(seen.container)
        )
    )
    return next((point.walked_m for point in points if point.location == target), move.cost)


def _named(known: Mapping[str, Configuration], name: str, site: Site) -> Configuration:
    from workbench.errors import UnknownName

    if name not in known:
        raise UnknownName("configuration", name, known, str(site.path))
    return known[name]


def _run_one(experiment: SpotExperiment, configuration: Configuration, strategy: str) -> SpotRow:
    from recorders.spot.client.time_source import SteppedClock
    from recorders.spot.run.operator import AgreeingOperator
    from recorders.spot.run.run import RobotRun, run_and_record
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.simulated.missed_tags import MissedTags
    from recorders.spot.simulated.session import simulated_robot
    from workbench.errors import OutputExists

    site, house = site_and_house(experiment.site, configuration)
    log = experiment.folder / f"spot_{configuration.name}_{strategy}.mcap"
    if log.exists() and not experiment.force:
        raise OutputExists(log)
    run = RobotRun(
        site=site,
        task=experiment.task,
        strategy=strategy,
        estimator=experiment.estimator_of(strategy),
        seed=experiment.seed,
        costs=ROBOT_COSTS,
        rates=thin_rates(experiment.images_hz, raw=experiment.raw),
        settings=RunSettings(sees_m=experiment.sees_m),
        truth=house.contents,
        own_estop=True,
        title=f"configuration {configuration.name}: {experiment.task.title}",
    )
    with simulated_robot(site, house, clock=SteppedClock(), seed=experiment.seed) as (robot, connection):
        if experiment.miss_rate is not None:
            with robot.state.alive() as state:
                state.missed_tags = MissedTags(rate=experiment.miss_rate, seed=experiment.seed)
        report = run_and_record(connection, run, log, operator=AgreeingOperator(), force=experiment.force)
    paper = configuration.paper.get(strategy)
    ended = require_beliefs(report.ended)
    return SpotRow(
        configuration=configuration.name,
        strategy=strategy,
        status=ended.status.value,
        seconds=report.seconds,
        searches=ended.searches,
        cost=ended.cost,
        travel_m=ended.travel_m,
        estimator=experiment.estimator_of(strategy),
        log=log,
        paper_seconds=None if paper is None else paper.seconds,
        paper_searches=None if paper is None else paper.searches,
        reason=ended.reason,
    )


def thin_rates(images_hz: float, *, raw: bool = True) -> Rates:
    """Rates for small logs: two poses a second, few and small pictures."""
    from recorders.spot.session.session import Rates

    return Rates(
        state_hz=1.0,
        localization_hz=2.0,
        fiducials_hz=0.5,
        images_hz=images_hz,
        grid_hz=0.02,
        clock_hz=0.05,
        cameras=("frontleft_fisheye_image", "frontleft_depth") if raw else ("frontleft_fisheye_image",),
        image_ratio=0.5,
        raw=raw,
    )
