"""`lios export`: logs as Parquet or CSV tables, or as recordings for Rerun's viewer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from workbench.errors import BadValue, MissingExtra
from workbench.options import Json
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json, progress, say

if TYPE_CHECKING:
    from replayers.runs.gaps import LogLosses

FORMATS = ("parquet", "csv", "rrd")


def export(
    where: Annotated[list[str], Argument(help="Logs, folders or patterns.")],
    output: Annotated[
        Path,
        Option("-o", "--output", help="A folder; or x.csv or x.parquet for one table, x.rrd for one log."),
    ],
    file_format: Annotated[
        str, Option("--format", help="parquet, csv or rrd (for Rerun's viewer); default: by the output's extension.")
    ] = "",
    table: Annotated[list[str] | None, Option("--table", "-t", help="Only this table; may be repeated.")] = None,
    partition_by: Annotated[
        str, Option("--partition-by", help="place, scenario, strategy, source, run_id; separated by commas.")
    ] = "",
    force: Annotated[bool, Option("--force", help="Replace existing files.")] = False,
    as_json: Json = False,
) -> None:
    """Write the tables of logs: runs, decisions, observations, beliefs, find_costs, plans, actions, poses.

    With --format rrd, write a recording for Rerun's viewer of each log: house, path, beliefs, costs, notes.

    Examples:

        lios export run.mcap -o tables/

        lios export logs/ -o tables/ --partition-by scenario,strategy

        lios export logs/ -o csv/ --format csv -t runs -t actions

        lios export logs/ -o runs.csv

        lios export run.mcap -o run.rrd
    """
    from replayers.log_tools.log_paths import find_logs

    suffix = output.suffix.lower().removeprefix(".")
    single = suffix in FORMATS and not output.is_dir()
    if file_format not in ("", *FORMATS) or (single and file_format not in ("", suffix)):
        raise BadValue("--format", file_format, suffix if single else "parquet, csv or rrd")
    kind = file_format or (suffix if single else "parquet")
    logs = find_logs(where)
    if kind == "rrd":
        for option, given in (("--table", ",".join(table or ())), ("--partition-by", partition_by)):
            if given:
                raise BadValue(option, given, "left out: a recording for Rerun holds a whole run")
        _recordings(logs, output, single=single, force=force, as_json=as_json)
        return
    _tables(
        logs,
        output,
        file_format="csv" if kind == "csv" else "parquet",
        single=single,
        table=table,
        partition_by=partition_by,
        force=force,
        as_json=as_json,
    )


def _tables(
    logs: Sequence[Path],
    output: Path,
    *,
    file_format: Literal["parquet", "csv"],
    single: bool,
    table: Sequence[str] | None,
    partition_by: str,
    force: bool,
    as_json: bool,
) -> None:
    from replayers.runs.gaps import losses_of_logs
    from replayers.tables.export import export as write
    from replayers.tables.export import export_table, table_names

    names = table_names(table or (("runs",) if single else ()))
    if single:
        name, *more = names
        if more or partition_by:
            raise BadValue("--output", str(output), "a folder for several tables or partitions")
        done = export_table(logs, output, table=name, file_format=file_format, force=force)
    else:
        done = write(
            logs,
            output,
            tables=names,
            file_format=file_format,
            partition_by=[name.strip() for name in partition_by.split(",") if name.strip()],
            force=force,
            progress=lambda tables: progress(tables, title="export", total=len(names)),
        )
    lost = losses_of_logs(logs)
    if as_json:
        problems = [{"file": problem.path, "reason": problem.reason} for problem in done.problems]
        emit_json(
            {
                "output": str(done.folder),
                "rows": done.rows,
                "problems": problems,
                "lost": lost.lost,
                "cut_off": lost.cut_off,
            }
        )
    for name, count in done.rows.items():
        say(f"{name}: {count:,} row{'' if count == 1 else 's'}")
    say(f"Wrote {done.folder} ({'CSV' if file_format == 'csv' else 'Parquet'}).")
    _say_what_is_missing([problem.reason for problem in done.problems], lost)


def _recordings(logs: Sequence[Path], output: Path, *, single: bool, force: bool, as_json: bool) -> None:
    try:
        from dashboards.rerun_export.write import write_rrd
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "rerun":
            raise
        raise MissingExtra("lios export --format rrd", "rerun") from error
    from dashboards.library.library import Library
    from replayers.log_tools.notes import notes_of
    from replayers.runs.gaps import losses_of_logs
    from workbench.errors import LiosError, OutputExists

    library = Library(logs)
    files = _recording_files(library.paths, output, single=single)
    if not force:
        for path in files:
            if path.exists():
                raise OutputExists(path)
    sizes: dict[str, int] = {}
    problems: dict[str, str] = {}
    for index, (log, path) in enumerate(progress(list(zip(library.paths, files, strict=True)), title="export")):
        try:
            sizes[str(path)] = write_rrd(library.timeline(index), notes_of(log), path, force=force)
        except LiosError as error:
            if len(files) == 1:
                raise
            problems[str(log)] = str(error)
    lost = losses_of_logs([log for log in logs if str(log) not in problems])
    if as_json:
        rows = [{"file": log, "reason": reason} for log, reason in problems.items()]
        emit_json(
            {"output": str(output), "bytes": sizes, "problems": rows, "lost": lost.lost, "cut_off": lost.cut_off}
        )
    for path, size in sizes.items():
        say(f"Wrote {path} ({size / 1e6:.2f} MB). Open it: rerun {path}")
    _say_what_is_missing(list(problems.values()), lost)


def _recording_files(logs: Sequence[Path], output: Path, *, single: bool) -> list[Path]:
    """The recording to write for each log.

    Raises:
        BadValue: several logs for one file, or of one name for one folder.
    """
    if single:
        if len(logs) > 1:
            raise BadValue("--output", str(output), f"a folder: a recording is made of each of {len(logs)} logs")
        return [output]
    names = [log.stem for log in logs]
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise BadValue("the logs", f"{twice}.mcap", "logs with different names: their recordings go into one folder")
    return [output / f"{name}.rrd" for name in names]


def _say_what_is_missing(problems: Sequence[str], lost: LogLosses) -> None:
    """Say what was left out or lost, and end with exit code 3 if anything was."""
    from replayers.commands.losses import end_with_losses

    for reason in problems:
        say(f"left out: {reason}")
    end_with_losses(lost, unreadable=len(problems))
