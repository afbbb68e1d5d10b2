"""Tidy tables of one or many logs, one row for each fact, built when first requested.

    import replayers
    replayers.read("run.mcap").tables.actions
    replayers.read_many("logs/**").decisions.groupby("run_id").planning_s.sum()

They need pyarrow, the extra `tables`. Only the topics that a table needs are decoded. A log that cannot be read does
not break the rest: it is listed in `problems`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, final

import msgspec

from replayers.log_tools.log_paths import NoLogs, find_logs, shown
from replayers.log_tools.multi_run import NoRunInLog, SeveralRuns, member_name
from replayers.mcap_io.messages import Message
from replayers.mcap_io.poses import poses_in
from replayers.mcap_io.reader import messages, metadata
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import is_closed
from replayers.tables.arrow import pa
from replayers.tables.build import BUILDERS, Source
from replayers.tables.schemas import SCHEMAS
from replayers.tables.to_pandas import Columns, arrow_table, data_frame, joined
from workbench.errors import LiosError
from workbench.log_schema.codec import decode
from workbench.log_schema.events import POSE_TOPIC, TOPIC_OF, TOPICS, TRUTH_TOPIC, RunInfo, Wire
from workbench.log_schema.run_info import INFO_METADATA, info_from_metadata
from workbench.terminal import counted
from workbench.third_party.data_frames import pd

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

__all__ = ["LogSource", "NoLogs", "RunSource", "Tables", "UnreadableLog", "find_logs", "read_many"]


KEPT_BYTES = 16 << 20
"""Logs whose sizes sum to less are read once, not topic by topic."""
_OF_TABLES = frozenset({*TOPICS, POSE_TOPIC} - {TRUTH_TOPIC})


@dataclass(frozen=True, slots=True)
class UnreadableLog:
    """A log that could not be read, and why."""

    path: str
    reason: str


@final
@dataclass(eq=False)
class Tables:
    """The tables of one or many runs, each a pandas data frame; replayers.tables.schemas lists the columns.

    Attributes:
        sources: the logs they come from.
        problems: logs that were left out because they could not be read.
    """

    sources: Sequence[Source]
    problems: list[UnreadableLog] = field(default_factory=list)

    def __repr__(self) -> str:
        """One line, as a notebook shows it."""
        broken = f", of which {len(self.problems)} could not be read" if self.problems else ""
        return f"<Tables of {counted(len(self.sources), 'log')}{broken}: {', '.join(SCHEMAS)}>"

    @cached_property
    def runs(self) -> pd.DataFrame:
        """One row for each run."""
        return self._frame("runs")

    @cached_property
    def decisions(self) -> pd.DataFrame:
        """One row for each decision."""
        return self._frame("decisions")

    @cached_property
    def observations(self) -> pd.DataFrame:
        """One row for each container whose contents became known."""
        return self._frame("observations")

    @cached_property
    def beliefs(self) -> pd.DataFrame:
        """One row for each decision, item type and container."""
        return self._frame("beliefs")

    @cached_property
    def find_costs(self) -> pd.DataFrame:
        """One row for each decision, item type, origin and target."""
        return self._frame("find_costs")

    @cached_property
    def plans(self) -> pd.DataFrame:
        """One row for each step of each plan."""
        return self._frame("plans")

    @cached_property
    def actions(self) -> pd.DataFrame:
        """One row for each action that ended."""
        return self._frame("actions")

    @cached_property
    def poses(self) -> pd.DataFrame:
        """One row for each pose that the robot reported or passed through."""
        return self._frame("poses")

    def arrow(self, name: str) -> pa.Table:
        """A table as Arrow, for DuckDB, polars or Parquet.

        Raises:
            KeyError: no such table.
        """
        return arrow_table(name, joined(name, list(self._by_log(name))))

    def _frame(self, name: str) -> pd.DataFrame:
        return data_frame(name, joined(name, list(self._by_log(name))))

    def parts(self, name: str) -> Iterator[pa.Table]:
        """A table as Arrow: first empty, with its columns, then one piece for each log."""
        yield SCHEMAS[name].empty_table()
        for columns in self._by_log(name):
            yield arrow_table(name, columns)

    def _by_log(self, name: str) -> Iterator[Columns]:
        for source in self.sources:
            try:
                part = BUILDERS[name](source)
            except (LiosError, OverflowError) as error:
                reason = str(error) if isinstance(error, LiosError) else f"{source.log}: a number beyond 64 bits"
                problem = UnreadableLog(source.log, reason)
                if problem not in self.problems:
                    self.problems.append(problem)
            else:
                yield part


def read_many(where: str | Path | Iterable[str | Path]) -> Tables:
    """The tables of many logs, read file by file when a table is first requested.

    Above 16 MiB of logs in all, each table reads its own topics; below, every log is read once and kept, undecoded.

    Args:
        where: a folder (searched whole), a pattern with * and **, one file, or several of these.

    Raises:
        NoLogs: nothing there.
    """
    paths = find_logs(where)
    small = sum(path.stat().st_size for path in paths) <= KEPT_BYTES
    return Tables([LogSource(path, keep=small) for path in paths])


@final
@dataclass(frozen=True)
class LogSource:
    """A log on disk.

    Attributes:
        keep: read it once and keep its messages, undecoded; otherwise every request reads the topic that it needs.
    """

    path: Path
    keep: bool = False

    @property
    def log(self) -> str:
        return shown(self.path)

    @property
    def info(self) -> RunInfo:
        return self._info

    @cached_property
    def _info(self) -> RunInfo:
        pairs = metadata(self.path, INFO_METADATA)
        if pairs is None:
            if metadata(self.path, member_name(INFO_METADATA, 0)) is not None:
                raise SeveralRuns(self.path)
            raise NoRunInLog(self.path, f"metadata {INFO_METADATA}")
        return info_from_metadata(pairs)

    @property
    def complete(self) -> bool:
        with open_log(self.path) as stream:
            return is_closed(stream)

    def events(self, event_class: type[Wire]) -> Sequence[Wire]:
        topic = TOPIC_OF[event_class]
        return cast("list[Wire]", [decode(topic, message.data) for message in self._messages(topic)])

    def poses(self) -> Sequence[tuple[int, PoseInFrame]]:
        found = self._messages(POSE_TOPIC)
        return poses_in((m.log_time, m.data) for m in found if m.channel.message_encoding == "protobuf")

    def _messages(self, topic: str) -> Iterable[Message]:
        return self._kept.get(topic, ()) if self.keep else messages(self.path, topics=topic.__eq__)

    @cached_property
    def _kept(self) -> dict[str, list[Message]]:
        found: dict[str, list[Message]] = {}
        for message in messages(self.path, topics=_OF_TABLES.__contains__):
            found.setdefault(message.topic, []).append(message)
        return found


@final
@dataclass(frozen=True, slots=True)
class RunSource:
    """The events of a run that was read already; not the run itself, which holds its tables and would form a
    reference cycle."""

    log: str
    info: RunInfo
    complete: bool
    found: Mapping[type[msgspec.Struct], Sequence[Any]]
    raw_poses: Sequence[tuple[int, bytes]]

    def events(self, event_class: type[Wire]) -> Sequence[Wire]:
        return self.found[event_class]

    def poses(self) -> Sequence[tuple[int, PoseInFrame]]:
        return poses_in(self.raw_poses)
