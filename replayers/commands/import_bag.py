"""`lios import`: a ROS bag as a log."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import Force, Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from replayers.importers.import_bag import ImportPlan, ImportReport


def import_bag(
    bag: Annotated[Path, Argument(help="ROS 1 .bag, ROS 2 bag folder, or its .mcap or .db3.", local=True)],
    site: Annotated[
        str, Option("--site", help="Survey file (site.yaml) or a shipped site: paper_home; none for a new place.")
    ] = "",
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("imported.mcap"),
    mapping: Annotated[
        str, Option("--mapping", "-m", help="Mapping file, or a preset: paper, spot_ros2, auto.")
    ] = "auto",
    task: Annotated[Path | None, Option("--task", help="The robot's task (YAML).")] = None,
    strategy: Annotated[
        str, Option("--strategy", "-s", help='Strategy whose plans are computed after the fact; "none" for none.')
    ] = "model-lios",
    estimator: Annotated[
        str,
        Option("--estimator", help="Estimator of the beliefs: as of lios record, also a .prompt or module:Class."),
    ] = "best",
    clock: Annotated[
        str, Option("--clock", help="Which times are used: record or header; auto takes headers where they agree.")
    ] = "auto",
    furniture_open: Annotated[
        bool, Option("--furniture-open", help="Assert that all closed furniture was open.")
    ] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Import a ROS bag: markers become observations, navigation goals moves, and the arm's results picks and places.

    Beliefs and plans, which no bag holds, are computed afterwards and marked as such. Without --site, the bag
    counts as a new place: its map, paths, stops and tags are recorded, and a survey can be drafted from them.

    Examples:

        lios import trial.bag --site home/site.yaml --mapping paper --task deliver.yaml -o trial.mcap

        lios import rosbag2_2026_01_05/ --site home/site.yaml -m spot_ros2 --json

        lios import round.bag -o round.mcap && lios site from-log round.mcap -o home
    """
    from recorders.spot.run.site_tasks import site_task
    from replayers.importers.bags import open_bag
    from replayers.importers.clocks import CLOCKS
    from replayers.importers.import_bag import ImportPlan, import_by_any
    from replayers.importers.mapping import mappings_for
    from workbench.errors import OutputExists, UnknownName
    from workbench.worlds.sites.site import load_site, unsurveyed_site

    if clock != "record" and clock != "header" and clock != "auto":
        raise UnknownName("clock", clock, (*CLOCKS, "auto"))
    if output.exists() and not force:
        raise OutputExists(output)
    place = load_site(site) if site else unsurveyed_site()
    with open_bag(bag) as opened:
        mappings = mappings_for(mapping, opened.topics)
        plan = ImportPlan(
            site=place,
            mapping=mappings[0],
            task=None if task is None else site_task(task, place),
            strategy="" if strategy == "none" or not site else strategy,
            estimator=estimator,
            clock=None if clock == "auto" else clock,
            furniture_open=furniture_open,
        )
        report, plan = import_by_any(opened, plan, mappings, output, force=force)
    if json:
        _emit(report, plan, output)
    else:
        _tell(report, plan, bag, output)


def _emit(report: ImportReport, plan: ImportPlan, output: Path) -> None:
    from dataclasses import asdict

    from workbench.terminal import emit_json

    emit_json(
        {
            "log": str(output),
            "mapping": plan.mapping.name,
            "status": report.ended.status,
            "seconds": report.seconds,
            "searches": report.ended.searches,
            "walked_m": report.walked_m,
            "looks": {
                "conclusive": report.ended.searches,
                "inconclusive": [asdict(look) for look in report.inconclusive],
            },
            "detections": {
                "placed": report.detections_placed,
                "late": report.detections_late,
                "not_placed": sum(report.detections_not_placed.values()),
                "reasons": report.detections_not_placed,
            },
            "transforms": {"static": report.static_transforms, "late": report.detections_late},
            "poses_not_placed": report.poses_not_placed,
            "clock": report.clock.as_json(),
            "moves": report.moves,
            "messages": report.messages,
            "unmapped": list(report.unmapped),
            "skipped": report.skipped,
            "profiles": list(report.profiles),
            "unknown_tags": list(report.unknown_tags),
            "ended": asdict(report.ended),
        }
    )


def _tell(report: ImportReport, plan: ImportPlan, bag: Path, output: Path) -> None:
    from workbench.terminal import counted, emit_table, say
    from workbench.worlds.sites.site import UNSURVEYED

    ended = report.ended
    say(f"{bag} by mapping {plan.mapping.name}: {report.seconds:.0f} s, {sum(report.messages.values())} messages")
    looked = counted(ended.searches, "container")
    say(f"{looked} looked into, {report.walked_m:.1f} m walked; {ended.status}: {ended.reason}")
    if report.unknown_tags:
        say(f"Tags that the site does not name: {', '.join(map(str, report.unknown_tags))}")
    if report.unmapped:
        say(f"Not mapped: {', '.join(report.unmapped[:8])}{', ...' if len(report.unmapped) > 8 else ''}")
    emit_table(_evidence(report), columns=("evidence", "number", "why"))
    draft = f"lios site from-log {output} -o FOLDER"
    more = draft if plan.site.name == UNSURVEYED else f"lios replay {output} --strategies all"
    say(f"Recorded to {output}. Next: {more}, or lios view {output}")


def _evidence(report: ImportReport) -> list[dict[str, Any]]:
    """What the bag supports, and what it does not, a row each."""
    doubts: dict[str, list[str]] = {}
    for look in report.inconclusive:
        doubts.setdefault(look.reason, []).append(look.container)
    clock = report.clock
    rows: list[tuple[str, int | str, str]] = [("looks", report.ended.searches, "")]
    rows += [("looks, inconclusive", len(where), f"{', '.join(where)}: {why}") for why, where in doubts.items()]
    rows.append(("detections, placed", report.detections_placed, ""))
    rows += [("detections, not placed", number, why) for why, number in report.detections_not_placed.items()]
    if report.detections_late:
        rows.append(("detections, placed late", report.detections_late, "their transforms are more than 1 s older"))
    rows.append(("transforms, static", report.static_transforms, "they hold for all time"))
    rows += [
        ("poses, not placed", number, f"{why}, not on the map") for why, number in report.poses_not_placed.items()
    ]
    rows.append(("clock", clock.name, clock.note))
    rows += [("topics, not read", topic, why) for topic, why in report.skipped.items()]
    rows += [("profile", repr(name), "not one of ROS; read by each topic's own schema") for name in report.profiles]
    return [dict(zip(("evidence", "number", "why"), row, strict=True)) for row in rows]
