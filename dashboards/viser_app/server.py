"""Serves the dashboard: a Viser server on this machine, with one session for each browser."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from threading import Thread
from typing import TYPE_CHECKING
from urllib.parse import quote

import viser

from dashboards.library.library import Library
from dashboards.model.scene import scene_at
from dashboards.resources import resource
from dashboards.viser_app.access import Access, token_for_a_run
from dashboards.viser_app.cameras import begin_at, fitted
from dashboards.viser_app.following import Follower
from dashboards.viser_app.guarded_server import guarded_server
from dashboards.viser_app.panel.controls import Controls
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_errors import ViewErrors
from dashboards.viser_app.view_state import ViewState
from workbench.errors import InputError

if TYPE_CHECKING:  # it loads what replays
    from dashboards.viser_app.ghost_watch import GhostWatch

LOCAL = "127.0.0.1"
USUAL_ASPECT = 1.3
"""Width over height of the view beside its panel, in a window of usual shape."""


class PortInUse(InputError):
    """Another program listens on the port."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"port {port} on {host} is in use. Give another --port, or --port 0 for any free one.")


class CannotListen(InputError):
    """The address is not one of this machine, or may not be used."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"cannot listen on {host}:{port}: {reason}. Give another --host or --port.")


@dataclass(slots=True)
class Dashboard:
    """A running server.

    Attributes:
        server: Viser's.
        sessions: one for each open page, by Viser's number of the client.
        ghosts: brings what is replayed beside such a run; None without.
        follower: reads what a run that is still being recorded adds; None otherwise.
        lost: what is missing from the runs that are shown at first, by their logs.
        token: what a visitor must know; None lets in all of this machine.
    """

    server: viser.ViserServer
    sessions: dict[int, BrowserSession] = field(default_factory=dict)
    follower: Follower | None = None
    ghosts: GhostWatch | None = None
    lost: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    token: str | None = field(default=None, repr=False)

    @property
    def url(self) -> str:
        """Where it listens, without the token: answers those who have the cookie."""
        host = self.server.get_host()
        named = {"0.0.0.0": LOCAL, "": LOCAL, "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)
        return f"http://{named}:{self.server.get_port()}"

    def link(self, query: str = "") -> str:
        """The address that opens it: with the token, and a view's query ("at=11&runs=1")."""
        token = "" if self.token is None else f"token={quote(self.token, safe='')}"
        fields = "&".join(part for part in (token, query) if part)
        return f"{self.url}/?{fields}" if fields else self.url

    def stop(self) -> None:
        if self.follower is not None:
            self.follower.stop()
        if self.ghosts is not None:
            self.ghosts.stop()
        for session in list(self.sessions.values()):
            session.stop()
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()


def serve(
    library: Library, state: ViewState, *, host: str = LOCAL, port: int = 8080, token: bool = True
) -> Dashboard:
    """Starts serving and returns at once.

    Args:
        token: whether visitors must know a token: the environment's, or one made for this run.

    Raises:
        PortInUse, CannotListen: nothing can listen there.
        BadToken: the environment names one that could be guessed.
        TokenRequired: no token is wanted where other machines could connect.
    """
    access = Access(host=host, token=token_for_a_run() if token else None)
    _check_port(host, port)
    # A browser may disconnect at any moment; messages queued for it can be dropped.
    warnings.filterwarnings("ignore", message="Queued .* on a closed connection", category=UserWarning)
    server = guarded_server(access, port=port, label="LIOS workbench", head=resource("viser_app/head.js"))
    dashboard = Dashboard(server, token=access.token)
    shape = library.shape(library.timeline(state.runs[0]).plan)
    Thread(target=_prepare, args=(library, state), name="prepare", daemon=True).start()
    begin_at(server, fitted(shape, aspect=USUAL_ASPECT))

    def arrive(client: viser.ClientHandle) -> None:
        ghosts = dashboard.ghosts.runs if dashboard.ghosts is not None else ()
        with client.atomic():  # the browser builds its page once, not part by part
            session = BrowserSession(client, library, replace(state, runs=(*state.runs, *ghosts)))
            dashboard.sessions[client.client_id] = session
            Controls(session)
            session.start()
        if client.client_id not in server.get_clients():
            leave(client)  # It disconnected while its view was being built; its disconnect event came too early.

    def leave(client: viser.ClientHandle) -> None:
        session = dashboard.sessions.pop(client.client_id, None)
        if session is not None:
            session.stop()

    server.on_client_connect(arrive)
    server.on_client_disconnect(leave)
    return dashboard


def _prepare(library: Library, state: ViewState) -> None:
    """Works out the first moment once, while a browser is still loading its page: loading and caches take a while."""
    for run in state.runs:
        with ViewErrors("getting ready").caught(library.paths[run].name, lambda _: None):
            if not library.is_expected(run):
                timeline = library.timeline(run)
                scene_at(timeline, timeline.start_ns, focus=state.focus, ahead=False)


def _check_port(host: str, port: int) -> None:
    """Viser silently takes the next free port; a person who named a port wants that one."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except (OSError, OverflowError) as error:
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            raise PortInUse(host, port) from error
        raise CannotListen(host, port, str(error)) from error
