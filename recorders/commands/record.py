"""`lios record`: one simulated run to one MCAP file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import AssetsOrBeside, MemoryLogs, MissRate, MoveRatesFile, Sees, ServePort, Upload
from workbench.parameters import Option

if TYPE_CHECKING:
    from recorders.simulated_run import Trial
    from workbench.execution.events import RunEnded


def record(
    house: Annotated[
        str,
        Option(
            "--house",
            help="houses:9 (a shipped one), FILE:INDEX, FILE.json, FILE.yaml (lios new house), or a site: "
            "site.yaml, site.yaml:CONFIGURATION; default: houses:0.",
        ),
    ] = "",
    find: Annotated[str, Option("--find", help="Item type to find and bring back to the start.")] = "",
    scenario: Annotated[str, Option("--scenario", help="A scenario by name: deliver-3, breakfast, coffee, ...")] = "",
    task: Annotated[Path | None, Option("--task", help="A task file (YAML).")] = None,
    strategy: Annotated[
        str,
        Option(
            "--strategy",
            "-s",
            help="Strategy, module:Class, or a built-in search policy; one of your own needs a strategy around it.",
        ),
    ] = "conditioned-lios",
    estimator: Annotated[
        str,
        Option("--estimator", help="counts, fcnn, best, people, mixed, a .safetensors, a .prompt, or module:Class."),
    ] = "best",
    seed: Annotated[int, Option("--seed", help="Seed of the scenario and of the containers known at the start.")] = 0,
    known: Annotated[
        float | None,
        Option("--known", help="Largest share of containers known at the start; default 0 for --find, else 0.2."),
    ] = None,
    miss_rate: MissRate = 0.0,
    sees: Sees = 0.0,
    memory: MemoryLogs = None,
    rates: MoveRatesFile = None,
    day: Annotated[
        int | None,
        Option("--day", help="Day of the run, from 0; default 0, with --memory the first day after all logs."),
    ] = None,
    moved: Annotated[
        float,
        Option("--moved", help="Share of the items to move away from where the house file puts them."),
    ] = 0.0,
    assets: AssetsOrBeside = None,
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("run.mcap"),
    split_mb: Annotated[
        float | None, Option("--split-mb", help="Continue in another file (NAME_0001.mcap, ...) beyond this size.")
    ] = None,
    split_s: Annotated[
        float | None, Option("--split-s", help="Continue in another file after this many seconds of the run.")
    ] = None,
    serve: ServePort = None,
    upload: Upload = "",
    force: Annotated[bool, Option("--force", help="Replace the output.")] = False,
    json: Annotated[bool, Option("--json", help="Print the result as JSON on standard output.")] = False,
) -> None:
    """Record one simulated run to an MCAP file.

    Examples:

        lios record --find mug --strategy lios -o run.mcap

        lios record --find mug --miss-rate 0.2 -o run.mcap

        lios record --find mug --sees 2.5 -o run.mcap

        lios record --find mug --memory logs/ --moved 0.25 -o run.mcap

        lios record --house paper_home:B --find "water bottle" -o run.mcap

        lios record --house houses.jsonl.gz:17 --scenario deliver-3 --strategy model-lios -o run.mcap
    """
    import recorders
    from recorders.sinks.files import LogFiles, SplitLimits
    from recorders.sinks.mirrored import watched
    from workbench.errors import Failed, OutputExists, Unsupported
    from workbench.execution.events import RunStatus
    from workbench.planning.strategies import resolved_name
    from workbench.remote.upload import require_upload, send
    from workbench.terminal import patience, say

    if upload:
        require_upload(upload, output)
    if output.exists() and not force and split_mb is None and split_s is None:
        raise OutputExists(output)
    split = SplitLimits(part_bytes=None if split_mb is None else round(split_mb * 1e6), part_s=split_s)
    files = None if split.never else LogFiles(output, split=split, force=force)
    by = resolved_name(strategy)
    trials: list[Trial] = []

    def begun(trial: Trial) -> None:
        trials.append(trial)
        what = trial.task.title or trial.task.scenario
        if not json:
            say(f"{what} in {trial.house.plan.name} by {by}, seed {trial.seed}")

    with watched(output.name, serve) as audience, patience():
        end = recorders.record(
            output,
            house=house or "houses:0",
            find=find,
            scenario=scenario,
            task=task,
            strategy=strategy,
            estimator=estimator,
            seed=seed,
            known=known,
            miss_rate=miss_rate,
            sees=sees,
            memory=memory or (),
            rates=rates,
            day=day,
            moved=moved,
            assets=assets,
            force=force,
            sink=files,
            audience=audience,
            begun=begun,
        )
    parts = None if files is None else files.parts
    if json:
        _emit(trials[0], by, end, output, parts)
    else:
        _tell(end, output, parts)
    if upload:
        for part in (output,) if parts is None else parts:
            send(part, upload, force=force)
    if end.status is RunStatus.PLANNER_FAILED:
        raise Failed(f"{by} broke: {end.reason}")
    if end.status is RunStatus.ESTIMATOR_FAILED:
        raise Unsupported(f"{end.reason} What was recorded until then is in {output}.")


def _emit(trial: Trial, by: str, end: RunEnded, output: Path, parts: Sequence[Path] | None) -> None:
    from workbench.terminal import emit_json

    files = [str(part) for part in ((output,) if parts is None else parts)]
    emit_json(
        {
            "log": files[0],
            "parts": files,
            "place": trial.house.plan.name,
            "scenario": trial.task.scenario,
            "strategy": by,
            "status": end.status,
            "reason": end.reason,
            "cost": end.cost,
            "searches": end.searches,
            "travel_m": end.travel_m,
            "decisions": end.decision,
            "seed": trial.seed,
        }
    )


def _tell(end: RunEnded, output: Path, parts: Sequence[Path] | None) -> None:
    from workbench.execution.events import RunStatus
    from workbench.terminal import counted, say

    looked = counted(end.searches, "container")
    say(f"{end.status}: cost {end.cost:.1f}, {looked} searched, {end.travel_m:.1f} m walked")
    if end.status not in (RunStatus.DONE, RunStatus.PLANNER_FAILED, RunStatus.ESTIMATOR_FAILED):
        say(f"Why: {end.reason}")
    if parts is None:
        say(f"Recorded to {output}. Next: lios replay {output} --strategies all, or lios view {output}")
    else:
        named = " ".join(map(str, parts))
        say(f"Recorded to {named}. Each opens alone; one log of them: lios log merge {named} -o {output}")
