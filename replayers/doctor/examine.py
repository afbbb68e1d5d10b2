"""Every check of a log, of the file and of the run in it, with a verdict and what to do.

fine    nothing is wrong that matters
lossy   what is there is sound, but something is missing: it was cut off, or messages were dropped
faulty  something in it is not what it should be
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, Metadata

from replayers.doctor.container_checks import ContainerScan, walk_container
from replayers.doctor.findings import Finding, Findings, Level, Verdict
from replayers.doctor.run_checks import RunChecks
from replayers.log_tools.multi_run import unmarked
from replayers.mcap_io.messages import Message
from replayers.mcap_io.scan import open_log
from replayers.runs.gaps import gaps_of
from replayers.runs.run import read
from workbench.errors import LiosError
from workbench.remote.path import path_of

Progress = Callable[[Iterator[Message | Attachment | Metadata]], Iterable[Message | Attachment | Metadata]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Examination:
    """What the doctor says.

    Attributes:
        loss_window_s: the most that a crash could have lost while this was recorded: for logs recorded in real time,
            the longest span of log time that one chunk held in memory; where log times are those of a simulated
            world, the longest time that the recorder waits before it syncs.
        loss_window_measured: whether it is the former, measured from the log.
        longest_chunk_s: the longest span of log time in one chunk.
        messages: how many are intact.
        source: where the run comes from: simulation, spot, import, ...; "" where the log does not say.
    """

    file: Path
    verdict: Verdict
    findings: tuple[Finding, ...]
    loss_window_s: float
    loss_window_measured: bool
    longest_chunk_s: float
    messages: int
    holds_run: bool
    source: str = ""


def examine(path: Path | str, *, progress: Progress = iter) -> Examination:
    """Examines a log, streaming.

    Args:
        progress: wraps the records as they are read, for a progress bar.

    Raises:
        FileMissing, NoMcap: there is nothing to examine.
    """
    path, findings = path_of(path), Findings()
    walk, runs, count = ContainerScan(findings), dict[int | None, RunChecks](), 0
    with open_log(path) as stream:
        for part in progress(walk_container(path, stream, walk)):
            count += isinstance(part, Message)
            run, plain = unmarked(part)
            if run not in runs:
                runs[run] = RunChecks(findings)
            runs[run].take(plain)
    if len(runs) > 1:
        runs.pop(None, None)  # what was added to a log of several runs
    if None not in runs and runs:
        findings.add(Level.INFO, "runs", f"{len(runs)} in one log", "Take them apart: lios log split --by run")
    checks = next(iter(runs.values()), RunChecks(findings))
    lost = _missing_from_run(path, checks) if len(runs) <= 1 and not (walk.cut_off or walk.damaged) else ()
    for line in lost:
        findings.add(Level.LOSS, "run", line)
    for each in runs.values() or (checks,):
        each.finish(cut_off=walk.cut_off, damaged=walk.damaged or bool(lost))
    longest_s, promised_s = walk.chunk_span_ns / 1e9, checks.promised_s
    measured = checks.real_time or promised_s is None
    return Examination(
        file=path,
        verdict=findings.verdict,
        findings=tuple(findings.all()),
        loss_window_s=longest_s if measured or promised_s is None else promised_s,
        loss_window_measured=measured,
        source="" if checks.info is None else checks.info.source,
        longest_chunk_s=longest_s,
        messages=count,
        holds_run=checks.holds_run,
    )


def _missing_from_run(path: Path, checks: RunChecks) -> tuple[str, ...]:
    """What is missing from the run in a whole file, as after a filter; what a recovered copy or a part lacks is told
    of those as such."""
    if not checks.may_be_complete:
        return ()
    try:
        return gaps_of(read(path)).lost
    except LiosError:
        return ()  # the checks of its events say what is wrong
