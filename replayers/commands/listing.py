"""`lios list`: the runs of a folder as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.errors import BadValue
from workbench.options import Json
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json, emit_table, progress, say

if TYPE_CHECKING:
    from replayers.log_tools.info import Description
    from replayers.log_tools.listing import LogRow

SORTS = ("file", "place", "scenario", "strategy", "status", "cost", "duration_s", "started_ns", "size_bytes")


def list_logs(
    where: Annotated[list[str] | None, Argument(help="Folders, patterns or logs; this folder by default.")] = None,
    scenario: Annotated[str, Option(help="Only runs of this scenario.")] = "",
    strategy: Annotated[str, Option(help="Only runs of this strategy.")] = "",
    place: Annotated[str, Option(help="Only runs whose house or site contains this text.")] = "",
    status: Annotated[str, Option(help="Only runs with this outcome: done, no-plan, ...")] = "",
    sort: Annotated[str, Option(help=f"By one of: {', '.join(SORTS)}.")] = "file",
    fresh: Annotated[bool, Option("--fresh", help="Read every log again.")] = False,
    as_json: Json = False,
) -> None:
    """List runs: house, scenario, strategy, outcome, cost, and what is missing from them. Rows are cached.

    Replays in imagined worlds are marked with the number of containers whose contents are imputed because nobody saw
    them.

    Examples:

        lios list logs/

        lios list 'logs/**/*.mcap' --strategy model-lios --sort cost --json
    """
    from replayers.log_tools.listing import cache_path, rows_of
    from replayers.log_tools.log_paths import find_logs
    from workbench.remote.path import RemotePath, path_of

    if sort not in SORTS:
        raise BadValue("--sort", sort, f"one of {', '.join(SORTS)}")
    if strategy:
        from workbench.planning.strategies import resolved_name

        strategy = resolved_name(strategy)
    places = where or ["."]
    here = path_of(places[0])
    kept = len(places) == 1 and not fresh and not isinstance(here, RemotePath) and here.is_dir()
    memory = cache_path(here) if kept else None
    paths = find_logs(places)
    rows = rows_of(paths, memory=memory, progress=lambda new: progress(list(new), title="reading"), check=_missing)
    wanted = [
        row
        for row in rows
        if (not scenario or row.scenario == scenario.lower())
        and (not strategy or row.strategy == strategy)
        and (not status or row.status == status)
        and place in row.place
    ]
    wanted.sort(key=lambda row: ((value := getattr(row, sort)) is None, value if value is not None else 0))
    answers = [_answer(row) for row in wanted]
    if as_json:
        emit_json({"rows": answers})
        _end(wanted)
        return
    columns = ["file", "place", "scenario", "strategy", "status", "cost", "searches", "duration_s", "problem"]
    problems, imagined = sum(bool(row.problem) for row in wanted), sum(bool(row.imputed) for row in wanted)
    if not problems:
        columns.remove("problem")
    if imagined:
        columns.insert(columns.index("status"), "imputed")
    emit_table(answers, columns=columns)
    say(
        f"{len(wanted)} of {len(rows)} logs"
        + (f", {problems} with a problem" if problems else "")
        + (f", {imagined} of imagined worlds: what so many containers hold is imputed" if imagined else "")
    )
    _end(wanted)


def _missing(found: Description) -> tuple[str, ...]:
    """What is missing from a log; a list that is cached loads nothing for it."""
    from replayers.runs.gaps import losses_of_listed

    return losses_of_listed(found)


def _end(rows: list[LogRow]) -> None:
    """Ends with 3 where something had to be dropped, or is missing from a run; a missing end is only said."""
    from replayers.log_tools.listing import Completeness

    if any(row.lost or (row.run_id and row.problem not in ("", Completeness.CUT_OFF.value)) for row in rows):
        raise click.exceptions.Exit(3)


def _answer(row: LogRow) -> dict[str, Any]:
    return {name: getattr(row, name) for name in row.__struct_fields__}
