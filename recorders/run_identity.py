"""The identity of a run (RunInfo) and its id, as every recording, replay and import writes them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import msgspec

from recorders.code_revision import revision
from workbench import __version__
from workbench.beliefs.memory.memory_estimator import without_memory
from workbench.log_schema.events import SCHEMA_VERSION, RunInfo, Stamp
from workbench.planning.tasks import Task


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """Who drives a run, as its log names it."""

    strategy: str
    estimator: str
    seed: int = 0


def run_id(*identity: bytes | str) -> str:
    """A run id of twelve hexadecimal digits; the same parts in the same order have the same id."""
    digest = hashlib.sha256()
    for part in identity:
        digest.update(part if isinstance(part, bytes) else part.encode())
    return digest.hexdigest()[:12]


def run_info(
    task: Task,
    driver: Driver,
    *,
    id: str,
    place: str,
    started_ns: int,
    source: str = "simulation",
    title: str = "",
    inertial_frame: str = "",
) -> RunInfo:
    """The identity of a run that this code records.

    Args:
        id: from run_id.
        place: the name of the house or site.
        title: the task's own by default.
        inertial_frame: of a robot, the frame of its odometry.
    """
    return written_here(
        RunInfo(
            run_id=id,
            schema_version=SCHEMA_VERSION,
            place=place,
            scenario=task.scenario,
            strategy=driver.strategy,
            estimator=driver.estimator,
            seed=driver.seed,
            started=Stamp.of(started_ns),
            title=title or task.title,
            source=source,
            weights_sha256=without_memory(driver.estimator).partition("@")[2],
            inertial_frame=inertial_frame,
        )
    )


def written_here(info: RunInfo) -> RunInfo:
    """An identity with the schema version and the version of this code."""
    code = revision()
    return msgspec.structs.replace(
        info,
        schema_version=SCHEMA_VERSION,
        code_version=__version__,
        code_revision=code.commit,
        code_dirty=code.dirty,
    )
