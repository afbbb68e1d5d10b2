"""Export of logs for other tools: one Parquet or CSV file for each table, or partitioned Parquet for folders of logs.

Parquet carries each column's description as field metadata. CSV writes lists as JSON.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from replayers.log_tools.copy_log import NoDiskSpace
from replayers.tables.arrow import pa
from replayers.tables.frames import LogSource, Tables, UnreadableLog
from replayers.tables.schemas import SCHEMAS
from workbench.errors import BadValue, CannotCreate, Malformed, OutputExists, UnknownName, WrongKind
from workbench.files import draft_path, file_to_replace, remove_abandoned_drafts
from workbench.remote.path import path_of
from workbench.third_party.data_frames import pd

Format = Literal["parquet", "csv"]
Progress = Callable[[Iterator[str]], Iterable[str]]
PARTITIONS = ("place", "scenario", "strategy", "source", "run_id")


class NothingToExport(Malformed):
    """None of the logs could be read; nothing was written."""

    def __init__(self, problems: Sequence[UnreadableLog]) -> None:
        more = f" {len(problems) - 1} more could not be read." if len(problems) > 1 else ""
        super().__init__(f"nothing to export: {problems[0].reason}{more}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What was written.

    Attributes:
        folder: the folder, or the file of a single table.
        rows: how many were written, for each table.
        problems: logs that were left out, and why.
    """

    folder: Path
    rows: dict[str, int]
    problems: tuple[UnreadableLog, ...]


def table_names(names: Iterable[str]) -> tuple[str, ...]:
    """The named tables; all of them when none is named.

    Raises:
        UnknownName: no such table.
    """
    wanted = tuple(names) or tuple(SCHEMAS)
    for name in wanted:
        if name not in SCHEMAS:
            raise UnknownName("table", name, SCHEMAS)
    return wanted


def export(
    paths: Sequence[Path | str],
    folder: Path | str,
    *,
    tables: Sequence[str] = (),
    file_format: Format = "parquet",
    partition_by: Sequence[str] = (),
    force: bool = False,
    progress: Progress = iter,
) -> Exported:
    """Writes FOLDER/runs.parquet, FOLDER/actions.parquet, ...

    With force: these replace what has their names; whatever else the folder holds stays.
    With partition_by: FOLDER/actions/strategy=model-lios/part-0.parquet, as DuckDB, pandas and polars read it.

    Args:
        tables: their names; none for all.
        progress: wraps the tables as they are written, for a progress bar.

    Raises:
        NothingToExport: none of the logs holds a run.
        OutputExists: the folder holds something, and force is not given.
        WrongKind: it is a file.
        CannotCreate: it cannot be created.
        NoDiskSpace: the disk is full; nothing was written.
        BadValue: partitions of CSV, or by a column that is not in PARTITIONS.
    """
    tables, folder = table_names(tables), Path(folder)
    for column in partition_by:
        if column not in PARTITIONS or file_format == "csv":
            raise BadValue("--partition-by", column, f"of Parquet, by {', '.join(PARTITIONS)}")
    if folder.exists() and not folder.is_dir():
        raise WrongKind(folder, needed="folder")
    remove_abandoned_drafts(folder)
    if folder.exists() and any(folder.iterdir()) and not force:
        raise OutputExists(folder)
    draft = draft_path(folder / "tables")
    source = Tables([LogSource(path_of(path)) for path in paths])
    rows: dict[str, int] = {}
    there_before = folder.exists()
    try:
        _make(draft, folder)
        for name in progress(iter(tables)):
            rows[name] = (
                _partitioned(source, name, draft, partition_by)
                if partition_by
                else _one_file(source, name, draft, file_format)
            )
        left_out = {problem.path for problem in source.problems}
        if not any(rows.values()) and left_out >= {log.log for log in source.sources}:
            raise NothingToExport(source.problems)
        for made in sorted(draft.iterdir()):
            _replace(made, folder / made.name)
    except OSError as error:
        raise NoDiskSpace(folder, os.strerror(error.errno) if error.errno else str(error)) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        if not there_before and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
    return Exported(folder=folder, rows=rows, problems=tuple(source.problems))


def export_table(
    paths: Sequence[Path], file: Path, *, table: str, file_format: Format, force: bool = False
) -> Exported:
    """Writes one table as one file of any name.

    Raises:
        UnknownName, NothingToExport, OutputExists, CannotCreate, NoDiskSpace: as export.
    """
    if file.exists() and not force:
        raise OutputExists(file)
    file = file_to_replace(file)
    draft = draft_path(file)
    remove_abandoned_drafts(file.parent)
    try:
        done = export(paths, draft, tables=(table,), file_format=file_format)
        _replace(draft / f"{table}.{file_format}", file)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return Exported(folder=file, rows=done.rows, problems=done.problems)


def _make(draft: Path, folder: Path) -> None:
    try:
        draft.mkdir(parents=True)
    except OSError as error:
        raise CannotCreate(folder, error.strerror or str(error)) from error


def _replace(made: Path, target: Path) -> None:
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    made.rename(target)


def _one_file(source: Tables, name: str, folder: Path, file_format: Format) -> int:
    """One table as one file, written log by log, so that memory holds the rows of one log."""
    count = 0
    if file_format == "csv":
        with open(folder / f"{name}.csv", "w", encoding="utf-8", newline="") as stream:
            for number, part in enumerate(source.parts(name)):
                _csv_frame(part).to_csv(stream, index=False, header=number == 0)
                count += part.num_rows
        return count
    import pyarrow.parquet as pq

    schema = plain(SCHEMAS[name])
    with pq.ParquetWriter(folder / f"{name}.parquet", schema, compression="zstd") as writer:
        for part in source.parts(name):
            if part.num_rows:
                writer.write_table(part.cast(schema))
                count += part.num_rows
    return count


def _partitioned(source: Tables, name: str, folder: Path, by: Sequence[str]) -> int:
    """One table as a folder of files by the values of columns, taken from the run where the table lacks them."""
    import pyarrow.dataset as ds

    parts: list[pa.Table] = []
    for log in source.sources:
        (part,) = list(Tables([log], source.problems).parts(name))[1:] or [None]
        if part is None:
            continue
        part = part.cast(plain(SCHEMAS[name]))
        run = Tables([log]).arrow("runs").to_pylist()[0]
        for column in by:
            if column not in part.column_names:
                part = part.append_column(column, pa.array([run[column]] * part.num_rows, type=pa.string()))
        parts.append(part)
    if not parts:
        return 0
    table = pa.concat_tables(parts)
    kinds = pa.schema([(column, pa.string()) for column in by])
    ds.write_dataset(table, folder / name, format="parquet", partitioning=ds.partitioning(kinds, flavor="hive"))
    return table.num_rows


def plain(schema: pa.Schema) -> pa.Schema:
    """A schema with text in place of dictionaries, which differ from log to log; descriptions are kept."""
    return pa.schema(
        [
            pa.field(f.name, pa.string() if pa.types.is_dictionary(f.type) else f.type, metadata=f.metadata)
            for f in schema
        ]
    )


def _csv_frame(part: pa.Table) -> pd.DataFrame:
    frame = part.cast(plain(part.schema)).to_pandas()
    for field in part.schema:
        if pa.types.is_list(field.type):
            frame[field.name] = [msgspec.json.encode(list(value)).decode() for value in frame[field.name]]
    return frame
