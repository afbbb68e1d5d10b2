"""The ghosts of a run in a separate process, so that neither the robot nor a viewer waits for them.

The process reads the log from disk, at low priority and with bounded memory, and sends a report after each round.
It ends with the process that started it, even when that is killed. Where it dies itself, it is started again a few
times.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, final

import msgspec

from replayers.live.ghost_bounds import GhostReport
from replayers.live.ghosts import AnotherRun, Ghosts
from workbench.errors import LiosError
from workbench.plugins import NameOrigin
from workbench.process_pool import end_with_parent, one_thread_each

EVERY_S = 0.1
"""Seconds between looks at the log."""
MEMORY_BYTES = 4 << 30
"""What the process may allocate; where it needs more, it dies and is started again."""
MAX_RESTARTS = 3
NICENESS = 10


@final
class GhostProcess:
    """The process; a report is asked for without waiting.

    Args:
        log: the log being recorded.
        strategies: the ghosts.
        output: the folder for their recordings.
        origin: who gives the names.
    """

    def __init__(
        self, log: Path, strategies: tuple[str, ...], *, output: Path, origin: NameOrigin = NameOrigin.LOG
    ) -> None:
        self._of = (log.resolve(), strategies, output, origin)
        self._process: Any = None
        self._pipe: Connection | None = None
        self._deaths = 0
        self._ended = False
        self._start()

    @property
    def pid(self) -> int | None:
        """The number of the process; None where none runs."""
        return None if self._process is None else self._process.pid

    def latest(self) -> GhostReport | None:
        """The newest report since the last call; None where there is none."""
        newest: GhostReport | None = None
        while self._pipe is not None:
            try:
                if not self._pipe.poll():
                    break
                newest = msgspec.msgpack.decode(self._pipe.recv_bytes(), type=GhostReport)
            except (EOFError, OSError):
                newest = self._died() or newest
        if newest is not None and newest.ended:
            self._ended = True
            self.close()
        return newest

    def close(self) -> None:
        """Ends the process. Safe to call twice."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process, self._pipe = None, None

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, far = context.Pipe(duplex=False)
        self._process = context.Process(target=_work, args=(far, *self._of), name="ghosts", daemon=False)
        with one_thread_each(whatever_is_set=True):  # the robot needs the other cores
            self._process.start()
        far.close()

    def _died(self) -> GhostReport | None:
        """What to say after the process has ended without a last word; it is started again a few times."""
        self.close()
        self._deaths += 1
        if self._deaths <= MAX_RESTARTS:
            self._start()
            return None
        return GhostReport(ended=f"The replays beside the run ended {self._deaths} times and are not started again.")


def _work(pipe: Connection, log: Path, strategies: tuple[str, ...], output: Path, origin: NameOrigin) -> None:
    """The child process: one round after the other, until the run has ended."""
    end_with_parent()
    sys.stdout = sys.stderr  # standard output is the command's answer
    _limit()
    ghosts = Ghosts(log, strategies, output=output, origin=origin)
    with suppress(BrokenPipeError):
        report_rounds(ghosts, lambda report: pipe.send_bytes(msgspec.msgpack.encode(report)))


def report_rounds(ghosts: Ghosts, send: Callable[[GhostReport], None], *, every_s: float = EVERY_S) -> None:
    """Round after round until the run has ended or its log holds another one; what cannot be read is tried again."""
    said = ""
    while True:
        try:
            report = ghosts.next_round()
        except AnotherRun as error:
            send(GhostReport(ended=str(error)))
            return
        except LiosError as error:
            report = GhostReport(note=str(error)) if str(error) != said else None
            said = str(error)
        if report is None:
            time.sleep(every_s)
            continue
        send(report)
        if report.ended:
            return


def _limit() -> None:
    """Less of the processor than the robot and the view have, and bounded memory, where the system can."""
    with suppress(OSError):
        os.nice(NICENESS)
    with suppress(ImportError, OSError, ValueError):
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, hard))
