"""`lios export`: logs as Parquet or CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from workbench.errors import BadValue
from workbench.options import Json
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json, progress, say


def export(
    where: Annotated[list[str], Argument(help="Logs, folders or patterns.")],
    output: Annotated[Path, Option("-o", "--output", help="The folder to make; x.csv or x.parquet for one table.")],
    file_format: Annotated[str, Option("--format", help="parquet or csv; default: as the output is named.")] = "",
    table: Annotated[list[str] | None, Option("--table", "-t", help="Only this table; may be repeated.")] = None,
    partition_by: Annotated[
        str, Option("--partition-by", help="place, scenario, strategy, source, run_id; commas between.")
    ] = "",
    force: Annotated[bool, Option("--force", help="Replace tables that are there.")] = False,
    as_json: Json = False,
) -> None:
    """Write the tables of logs: runs, decisions, observations, beliefs, find_costs, plans, actions, poses.

    Examples:

        lios export run.mcap -o tables/

        lios export logs/ -o tables/ --partition-by scenario,strategy

        lios export logs/ -o csv/ --format csv -t runs -t actions

        lios export logs/ -o runs.csv
    """
    from replayers.log_tools.log_paths import find_logs
    from replayers.runs.gaps import loss_lines, losses_of_logs
    from replayers.tables.export import export as write
    from replayers.tables.export import export_table, table_names

    suffix = output.suffix.lower().removeprefix(".")
    single = suffix in ("parquet", "csv") and not output.is_dir()
    if file_format not in ("", "parquet", "csv") or (single and file_format not in ("", suffix)):
        raise BadValue("--format", file_format, suffix if single else "parquet or csv")
    kind = "csv" if "csv" in (file_format, suffix if single else "") else "parquet"
    logs = find_logs(where)
    names = table_names(table or (("runs",) if single else ()))
    if single:
        name, *more = names
        if more or partition_by:
            raise BadValue("--output", str(output), "a folder for several tables or partitions")
        done = export_table(logs, output, table=name, file_format=kind, force=force)
    else:
        done = write(
            logs,
            output,
            tables=names,
            file_format=kind,
            partition_by=[name.strip() for name in partition_by.split(",") if name.strip()],
            force=force,
            told=lambda tables: progress(tables, title="export", total=len(names)),
        )
    lost = losses_of_logs(logs)
    if as_json:
        problems = [{"file": problem.path, "reason": problem.reason} for problem in done.problems]
        emit_json({"output": str(done.folder), "rows": done.rows, "problems": problems, "lost": lost})
    for name, count in done.rows.items():
        say(f"{name}: {count:,} row{'' if count == 1 else 's'}")
    say(f"Wrote {done.folder} ({'CSV' if kind == 'csv' else 'Parquet'}).")
    for problem in done.problems:
        say(f"left out: {problem.reason}")
    for line in loss_lines(lost):
        say(line)
    if done.problems or lost:
        raise click.exceptions.Exit(3)
