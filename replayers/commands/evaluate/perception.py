"""`lios evaluate perception`: how surely looks detect what is there, from one's own logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from replayers.evaluation.detection_trials import PlantedItem, TrialsOfLog
    from replayers.evaluation.perception import DetectionRate


def perception(
    logs: Annotated[list[Path], Argument(help="Logs, or folders of logs.")],
    planted: Annotated[
        list[str] | None,
        Option("--planted", help="ITEM@CONTAINER: what was there at the start of every run; repeat for several."),
    ] = None,
    checked: Annotated[
        bool,
        Option(
            "--checked", help="Assert that people checked the containers and corrected every miss (lios log note)."
        ),
    ] = False,
    with_truth: Annotated[
        bool, Option("--with-truth", help="Use the truth recorded by simulated runs: every item is planted.")
    ] = False,
    by: Annotated[
        str, Option("--by", help="Tables, by comma: made, detector, item, container, range, angle. JSON has all.")
    ] = "made,detector,range,angle",
    json: Json = False,
) -> None:
    """Measure perception: how reliably looks detect items, by detector, item, container, range and angle.

    A look counts only where something else shows that the item is there: an earlier look, a correction, a planted
    item, or the truth of a simulation. In a robot's log the viewpoints that it passed count too, each once.

    Examples:

        lios evaluate perception trials/

        lios evaluate perception trials/ --planted mug@desk --planted egg@fridge --checked

        lios evaluate perception logs/spot-home-A.mcap --with-truth --json
    """
    from dataclasses import asdict

    from replayers.evaluation.detection_trials import each_once
    from replayers.evaluation.perception import KINDS, detection_rates
    from replayers.log_tools.log_paths import find_logs
    from workbench.errors import BadValue, Unsupported
    from workbench.terminal import counted, emit_json, emit_table, progress, say

    kinds = [kind.strip() for kind in by.split(",") if kind.strip()]
    if not kinds or not set(kinds) <= set(KINDS):
        raise BadValue("--by", by, f"names with commas between them of {', '.join(KINDS)}")
    files = find_logs(logs)
    found: list[TrialsOfLog] = []
    skipped: list[str] = []
    for log in progress(files, title="reading"):
        found += _trials_of(log, planted or [], skipped, checked=checked, with_truth=with_truth)
    if not found and skipped:
        others = f" (and {len(skipped) - 1} more that cannot be judged)" if len(skipped) > 1 else ""
        raise Unsupported(f"{skipped[0]}{others}")
    kept, copies = each_once(found)
    rates = detection_rates([trial for one in kept for trial in one.trials])
    for why in skipped:
        say(f"skipped {why}")
    for copy, other in copies.items():
        say(f"skipped {copy}: it shows nothing of its run that {other} does not show")
    if not rates:
        raise Unsupported(
            f"no look of {counted(len(files), 'log')} can be judged: none was made where the item was known to be. "
            "Look twice, plant items (--planted), correct misses (lios log note --seen), or give --with-truth."
        )
    if json:
        rows = [asdict(rate) for rate in rates]
        emit_json({"rows": rows, "logs": len(files), "skipped": skipped, "copies": copies})
        return
    emit_table([_shown(rate) for rate in rates if rate.by in kinds])
    for rate in rates:
        if (rate.by, rate.group) == ("made", "look"):
            looks = counted(rate.trials, "look")
            say(f"For the site's file, from {looks}: detector: {{p_detect: {rate.p_detect:.3f}}}")


def _trials_of(
    log: Path, planted: list[str], skipped: list[str], *, checked: bool, with_truth: bool
) -> list[TrialsOfLog]:
    from replayers.evaluation.detection_trials import TrialsOfLog, detection_trials
    from replayers.runs.run import read
    from workbench.errors import LiosError

    try:
        run = read(log, with_truth=with_truth)
    except LiosError as error:
        skipped.append(str(error))
        return []
    stood = _planted(planted, [str(c.id) for c in run.place.plan.containers], log)
    try:
        trials = tuple(detection_trials(run, stood, checked=checked))
        return [TrialsOfLog(log=str(log), run_id=run.info.run_id, trials=trials)]
    except LiosError as error:
        skipped.append(f"{log}: {error}")
        return []


def _planted(texts: list[str], containers: list[str], log: Path) -> tuple[PlantedItem, ...]:
    """The items planted.

    Raises:
        BadValue: not of the form ITEM@CONTAINER.
        UnknownName: no such container.
    """
    from replayers.evaluation.detection_trials import PlantedItem
    from workbench.errors import BadValue, UnknownName

    found: list[PlantedItem] = []
    for text in texts:
        item, _, where = (part.strip() for part in text.partition("@"))
        if not item or not where:
            raise BadValue("--planted", text, "ITEM@CONTAINER, such as Mug|1@desk")
        container = next((c for c in containers if c.lower() == where.lower()), None)
        if container is None:
            raise UnknownName("container", where, containers, where=str(log))
        found.append(PlantedItem(item=item, container=container))
    return tuple(found)


def _shown(rate: DetectionRate) -> dict[str, object]:
    return {
        "by": rate.by,
        "group": rate.group,
        "trials": rate.trials,
        "detected": rate.detected,
        "p_detect": rate.p_detect,
        "95 %": f"{rate.ci95[0]:.2f} to {rate.ci95[1]:.2f}",
    }
