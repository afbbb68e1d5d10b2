"""Opens logs, serves the dashboard, prints its address, and waits until it is stopped."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from dashboards.library.library import Library, NoLogsInFolder
from dashboards.viser_app.access import TokenRequired, is_loopback
from dashboards.viser_app.following import Follower, wait_for
from dashboards.viser_app.server import Dashboard, serve
from dashboards.viser_app.view_state import MAX_RUNS, ViewState
from replayers.memory.collect import read_history
from replayers.runs.gaps import losses
from workbench.errors import BadValue, FileMissing, LiosError
from workbench.terminal import say

PATIENCE_S = 600.0
"""How long to wait for a log to be followed that does not exist yet."""


def show_until_stopped(
    logs: Sequence[Path],
    *,
    host: str,
    port: int,
    at: float,
    follow: bool,
    token: bool = True,
    memory: bool = False,
    ghosts: str = "",
) -> Mapping[str, tuple[str, ...]]:
    """Serves until Ctrl-C; returns what is missing from the runs that are shown at first, by their logs.

    Raises:
        FileMissing, NoLogsInFolder, NoMcap and the other errors of reading a log; PortInUse, TokenRequired.
    """
    dashboard = open_dashboard(
        logs, host=host, port=port, at=at, follow=follow, token=token, memory=memory, ghosts=ghosts
    )
    try:
        # Said in here: whoever reads it may press Ctrl-C at once.
        say(f"Dashboard at {dashboard.link()} (Ctrl-C stops it).")
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        say("Stopped.")  # as requested: not a failure
    finally:
        dashboard.stop()
    return dashboard.lost


def open_dashboard(
    logs: Sequence[Path],
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    at: float = 0.0,
    follow: bool = False,
    token: bool = True,
    memory: bool = False,
    ghosts: str = "",
) -> Dashboard:
    """Reads the logs and starts serving.

    Args:
        memory: whether to show where each item was seen over days; the logs must then be of one place.
        ghosts: strategies to replay beside the one log that is followed, with commas between them.

    Raises:
        BadValue: a moment before the start, or ghosts without one log that is followed.
        UnknownName: a ghost that is no strategy.
        TokenRequired: no token where other machines could connect. And what reading logs and listening raise.
    """
    if not at >= 0:
        raise BadValue("--at", at, "seconds after the start, at least 0")
    if not 0 <= port <= 65535:
        raise BadValue("--port", port, "from 0 to 65535")
    if not token and not is_loopback(host):
        raise TokenRequired(host)
    names = _ghosts_named(ghosts, logs, follow=follow) if ghosts else ()
    if follow:
        _wait_for_logs(logs)
    library = Library(logs)
    library.followed = follow
    if memory:
        library.history = read_history(logs)
    named = [path for path in logs if not path.is_dir()]
    if named:
        for index in range(len(library.paths)):
            library.timeline(index)
        runs = tuple(range(min(len(library.paths), MAX_RUNS)))
        for path in library.paths[MAX_RUNS:]:
            say(f"Not shown at first: {path} (at most {MAX_RUNS} runs at once; the tab Runs lists all)")
    else:
        rows = library.rows()
        for problem in library.unreadable:
            say(f"Left out: {problem}")
        runs = (_first_readable(library, [row.index for row in rows if row.index >= 0]),)
    dashboard = serve(library, ViewState(runs=runs, at=at, live=follow), host=host, port=port, token=token)
    found = losses(library.timeline(index).run for index in runs)
    dashboard.lost = found.lost
    for line in found.lines:
        say(line)
    if follow:
        dashboard.follower = Follower(library, lambda: list(dashboard.sessions.values()))
    if names:
        from dashboards.viser_app.ghost_watch import GhostWatch

        dashboard.ghosts = GhostWatch(library, names, lambda: list(dashboard.sessions.values()))
    return dashboard


def _ghosts_named(text: str, logs: Sequence[Path], *, follow: bool) -> tuple[str, ...]:
    from dashboards.viser_app.ghost_watch import ghosts_named

    return ghosts_named(text, logs, follow=follow)


def _first_readable(library: Library, indices: Sequence[int]) -> int:
    """The index of the first run that can be shown; errors of those before it are printed.

    Raises:
        LiosError: what is wrong with the first log, when none can be shown.
    """
    for index in indices:
        try:
            library.timeline(index)
        except LiosError as error:
            say(f"Left out: {error}")
        else:
            return index
    library.timeline(0)
    raise NoLogsInFolder(library.folder or library.paths[0])


def _wait_for_logs(logs: Sequence[Path]) -> None:
    """Waits for a log that is about to be recorded."""
    for path in logs:
        if not path.exists():
            say(f"Waiting for {path} ...")
            if not wait_for(path, patience_s=PATIENCE_S):
                raise FileMissing(path)
