"""`lios evaluate spot`: the paper's configurations A to D on a simulated Spot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import Json
from workbench.parameters import Option

if TYPE_CHECKING:
    from replayers.evaluation.spot_experiment import CrossRow, SpotRow
    from workbench.worlds.sites.site import Site


def spot(
    site: Annotated[str, Option("--site", help="Survey file or shipped site, with configurations.yaml.")] = (
        "paper_home"
    ),
    task: Annotated[Path | None, Option("--task", help="Task file; default: deliver.yaml of the site.")] = None,
    configurations: Annotated[str, Option("--configurations", "-c", help="Names separated by commas.")] = "all",
    strategies: Annotated[str, Option("--strategies", "-s", help="Names separated by commas.")] = (
        "pes-greedy,pes-lios,model-lios,conditioned-lios"
    ),
    estimator: Annotated[
        str, Option("--estimator", help="Estimator of our strategies: as of lios record, also module:Class.")
    ] = "best",
    paper_estimator: Annotated[
        str, Option("--paper-estimator", help="Estimator of the paper's strategies.")
    ] = "fcnn",
    output: Annotated[Path | None, Option("--output", "-o", help="Folder in which to keep the logs.")] = None,
    cross: Annotated[bool, Option("--cross/--no-cross", help="Replay each log for the other strategies.")] = True,
    images_hz: Annotated[
        float, Option("--images-hz", min=0, max=60, help="Pictures per second in the logs; 0 for none.")
    ] = 0.03,
    raw: Annotated[bool, Option("--raw/--no-raw", help="Also log bosdyn's messages as received.")] = True,
    sees: Annotated[
        float,
        Option(
            "--sees", min=0, max=20, help="Metres from which a tag seen in passing counts; 0, as in the paper: none."
        ),
    ] = 0.0,
    miss_rate: Annotated[
        float | None,
        Option(
            "--miss-rate", help="Probability that the detector misses a tag from nearby (more from afar); default: 0."
        ),
    ] = None,
    seed: Annotated[int, Option("--seed", help="Seed of the sensors' noise and the strategies.")] = 0,
    force: Annotated[bool, Option("--force", help="Replace logs.")] = False,
    json: Json = False,
) -> None:
    """Run the paper's real-world experiment on a simulated Spot: seconds, containers opened, cost.

    Times are the robot's: walking, looking, manipulating; planning takes no robot time. The paper's figures are shown
    beside ours.

    Examples:

        lios evaluate spot

        lios evaluate spot --configurations A,B --strategies pes-greedy,model-lios -o spot-logs --json
    """
    import tempfile

    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.run.site_tasks import delivery_of, site_task
    from replayers.evaluation.spot_experiment import SpotExperiment, cross_replay, run_experiment
    from workbench.terminal import progress, say
    from workbench.worlds.sites.site import load_site

    place = load_site(site)
    chosen, names = _asked(place, configurations, strategies)
    with tempfile.TemporaryDirectory(prefix="lios-spot-") as scratch:
        experiment = SpotExperiment(
            site=place,
            task=site_task(task or delivery_of(place), place),
            folder=output or Path(scratch),
            configurations=chosen,
            strategies=names,
            estimator=estimator,
            paper_estimator=paper_estimator,
            seed=seed,
            images_hz=images_hz,
            raw=raw,
            sees_m=sees,
            miss_rate=miss_rate,
            force=force,
        )
        total = len(chosen) * len(names)
        rows = list(progress(run_experiment(experiment), title="running", total=total))
        crossed = list(progress(cross_replay(rows), title="replaying")) if cross else []
    if json:
        _emit(rows, crossed, seed=seed, kept=output is not None)
        return
    _tell(rows, crossed)
    if output is not None:
        say(f"Logs in {output}. Next: lios view {output}/spot_{chosen[0]}_{names[0]}.mcap")


def _asked(place: Site, configurations: str, strategies: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The configurations and the strategies, by name."""
    from replayers.batch.replay_all import strategies_named
    from workbench.errors import BadValue
    from workbench.worlds.sites.configurations import configurations_of

    known = tuple(configurations_of(place))
    chosen = known if configurations == "all" else tuple(dict.fromkeys(_listed(configurations)))
    names = strategies_named(strategies, with_truth=True)
    if not chosen or not names:
        raise BadValue("configurations and strategies", f"{configurations}; {strategies}", "at least one of each")
    return chosen, names


def _emit(rows: list[SpotRow], crossed: list[CrossRow], *, seed: int, kept: bool) -> None:
    """The result for machines; a log has a path only where logs are kept."""
    from dataclasses import asdict

    from workbench.terminal import emit_json

    emit_json(
        {
            "rows": [{**asdict(row), "log": str(row.log) if kept else None} for row in rows],
            "replayed": [asdict(row) for row in crossed],
            "inside_bounds": sum(row.inside for row in crossed) / len(crossed) if crossed else None,
            "seed": seed,
        }
    )


def _tell(rows: list[SpotRow], crossed: list[CrossRow]) -> None:
    from dataclasses import asdict

    from workbench.terminal import emit_table, emit_text

    columns = ("configuration", "strategy", "status", "seconds", "searches", "cost", "travel_m")
    emit_table([asdict(row) for row in rows], columns=(*columns, "paper_seconds", "paper_searches"))
    if crossed:
        exact, inside = sum(row.exact for row in crossed), sum(row.inside for row in crossed)
        emit_text(
            f"Replayed over one another's logs: {len(crossed)} counterfactuals, {exact} exact; "
            f"{inside} of the costs of the real runs lie within the bounds."
        )


def _listed(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
