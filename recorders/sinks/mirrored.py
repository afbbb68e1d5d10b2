"""A sink that passes everything to another sink and shows each message to viewers on the way."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol, final

from recorders.mcap_io.channels import ChannelSpec
from recorders.sinks.files import Sink
from workbench.terminal import say


class ViewerFeed(Protocol):
    """What messages are shown to; `publish` must not block."""

    def publish(self, channel: ChannelSpec, data: bytes, *, log_time: int) -> None: ...


@final
class MirroredSink:
    """A Sink that writes first and shows second: trouble with the viewers ends the showing, never the recording.

    Args:
        inner: the sink that records.
        audience: who watches, such as a LiveServer.
        on_trouble: called once with a message if showing ends; by default it prints to standard error.
    """

    def __init__(self, inner: Sink, audience: ViewerFeed, *, on_trouble: Callable[[str], None] = say) -> None:
        self._inner = inner
        self._audience: ViewerFeed | None = audience
        self._on_trouble = on_trouble

    @property
    def path(self) -> Path:
        return self._inner.path

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        written = self._inner.write(channel, data, log_time=log_time, publish_time=publish_time)
        if self._audience is not None:
            try:
                self._audience.publish(channel, data, log_time=log_time)
            except Exception as error:  # noqa: BLE001 - whatever a viewers' server raises, the robot's log goes on
                self._audience = None
                self._on_trouble(f"Viewers are no longer served: {error}. Recording goes on.")
        return written

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        self._inner.attach(name, media_type, data, log_time=log_time)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        self._inner.describe(name, values)

    def flush(self) -> None:
        self._inner.flush()

    def close(self) -> None:
        self._inner.close()


@contextmanager
def watched(name: str, port: int | None) -> Generator[ViewerFeed | None]:
    """A server for viewers on this machine while it is open; None without a port.

    Raises:
        MissingExtra, CannotServe: as for LiveServer.
    """
    if port is None:
        yield None
        return
    from recorders.foxglove.live_server import LiveServer, ServedAt

    server = LiveServer(name, ServedAt(port=port))
    try:
        say(f"Viewers can connect to {server.address} while it records.")
        yield server
    finally:
        server.close()
