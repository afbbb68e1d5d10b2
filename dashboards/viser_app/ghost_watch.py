"""Passes the reports of the ghosts' process to the library and the views.

The ghosts' recordings are logs like any other; the library awaits them until the first round has written them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Event, Thread
from typing import final

import msgspec

from dashboards.library.library import Library
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_errors import ViewErrors
from replayers.batch.replay_all import strategies_named
from replayers.counterfactual.sandbox import require_planner
from replayers.live.ghost_bounds import GhostReport
from replayers.live.ghost_process import GhostProcess
from replayers.live.ghosts import ghost_log
from workbench.errors import BadValue, LiosError
from workbench.planning.strategies import needs_truth
from workbench.plugins import NameOrigin

EVERY_S = 0.2
"""Seconds between looks at what the process has reported."""


def ghosts_named(text: str, logs: Sequence[Path], *, follow: bool) -> tuple[str, ...]:
    """The strategies that `--ghosts` means.

    Raises:
        BadValue: not one log that is followed, or a strategy that knows the house.
        UnknownName, StrategyNotLoaded: no such strategy.
    """
    if not follow or len(logs) != 1 or logs[0].is_dir():
        raise BadValue("--ghosts", text, "given with --follow and one log")
    names = strategies_named(text, with_truth=False)
    for name in names:
        require_planner(name.partition("@")[0])
        if needs_truth(name):
            raise BadValue("--ghosts", name, "a strategy that need not know what the containers hold")
    return names


@final
class GhostWatch:
    """The ghosts of a dashboard, until it is stopped.

    Args:
        library: of the one log that is followed, which gets a log more for each ghost.
        names: the strategies.
        sessions: those that are open.
    """

    def __init__(
        self, library: Library, names: tuple[str, ...], sessions: Callable[[], Sequence[BrowserSession]]
    ) -> None:
        self.library = library
        self._sessions = sessions
        self._folder = tempfile.TemporaryDirectory(prefix="lios-ghosts-")
        output = Path(self._folder.name)
        self.runs = library.expect_logs([ghost_log(output, name) for name in names])
        library.ghosts = GhostReport()
        self.process = GhostProcess(library.paths[0], names, output=output, origin=NameOrigin.USER)
        self._trouble = ViewErrors("of the ghosts")
        self._stopped = Event()
        self._thread = Thread(target=self._watch, name="ghosts", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends the process, and removes what it recorded."""
        self._stopped.set()
        self._thread.join(timeout=5)
        self.process.close()
        self._folder.cleanup()

    def _watch(self) -> None:
        while not self._stopped.wait(EVERY_S):
            with self._trouble.caught("the ghosts", lambda _: None):
                report = self.process.latest()
                if report is not None:
                    self._take(report)

    def _take(self, report: GhostReport) -> None:
        before = self.library.ghosts
        if before is not None and not report.bounds:  # a word about the rounds leaves the last bounds on show
            report = msgspec.structs.replace(before, note=report.note, ended=report.ended)
        self.library.ghosts = report
        for run in self.runs:
            if not self.library.is_expected(run):
                try:
                    self.library.reread(run)
                except LiosError:
                    continue  # replaced at this very moment; the next report comes soon
        for session in self._sessions():
            session.reread()
