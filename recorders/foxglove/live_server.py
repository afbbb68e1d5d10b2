"""A server that shows messages to Foxglove, Lichtblick and other viewers as they come, through the Foxglove SDK."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

from recorders.certificate import new_identity
from recorders.foxglove.relay import Relay
from recorders.mcap_io.channels import ChannelSpec
from workbench.errors import MissingExtra

if TYPE_CHECKING:
    from foxglove import Channel
    from foxglove.websocket import PlaybackControlRequest, PlaybackState

DEFAULT_PORT = 8765
"""What Foxglove's own servers use, and what viewers offer first."""

Control = Callable[["PlaybackControlRequest"], "PlaybackState | None"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedAt:
    """Where viewers find a server.

    Attributes:
        port: 0 takes any free one.
        origins: websites that may connect besides Foxglove's and Lichtblick's, such as "https://viewer.example.org".
    """

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    origins: Sequence[str] = ()


@dataclass(slots=True)
class _Served:
    """A channel as the SDK knows it, and the last message of a latched one, for viewers that come later."""

    channel: Channel
    last: tuple[bytes, int] | None = None


@final
class LiveServer:
    """Shows messages to any number of viewers. `publish` never blocks: viewers that are too slow miss messages.

    Args:
        name: what viewers show as the source.
        playback_ns: first and last time of a log that is played; None for live data.
        on_control: called when a viewer plays, pauses, seeks or changes the speed; in a thread of the SDK.
        on_subscribe: called when a viewer subscribes to a topic; in a thread of the SDK.

    Raises:
        MissingExtra: foxglove-sdk or trustme is not installed.
        CannotServe: the address is in use or not of this machine.
    """

    def __init__(
        self,
        name: str,
        at: ServedAt,
        *,
        playback_ns: tuple[int, int] | None = None,
        on_control: Control | None = None,
        on_subscribe: Callable[[], None] | None = None,
    ) -> None:
        try:
            import foxglove
            from foxglove.websocket import Capability
        except ImportError as error:
            raise MissingExtra("A server for viewers", "foxglove") from error
        from recorders.foxglove.sdk_listener import Listener

        logging.getLogger("foxglove").setLevel(logging.ERROR)
        identity = new_identity(["localhost"], needed_by="A server for viewers", extra="foxglove")
        self._context = foxglove.Context()
        self._channels: dict[ChannelSpec, _Served] = {}
        self._by_id: dict[int, _Served] = {}
        self._lock = threading.Lock()
        self._on_subscribe = on_subscribe
        self._server = foxglove.start_server(
            name=name,
            host="127.0.0.1",
            port=0,
            capabilities=[Capability.Time],
            server_listener=Listener(self.repeat_last, on_control),
            context=self._context,
            playback_time_range=playback_ns,
            tls_cert=identity.chain_pem,
            tls_key=identity.key_pem,
        )
        try:
            self._relay = Relay(
                at.host, at.port, upstream_port=self._server.port, root_pem=identity.root_pem, origins=at.origins
            )
        except Exception:
            self._server.stop()
            raise
        self.host = at.host

    @property
    def port(self) -> int:
        return self._relay.port

    @property
    def address(self) -> str:
        """What to give to a viewer."""
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return f"ws://{shown}:{self.port}"

    def declare(self, channel: ChannelSpec) -> None:
        """Offer a topic before its first message; to declare it again changes nothing."""
        self._served(channel)

    def publish(self, channel: ChannelSpec, data: bytes, *, log_time: int) -> None:
        """Show a message; the stamp is in nanoseconds."""
        served = self._served(channel)
        if channel.latched:
            served.last = (data, log_time)
        served.channel.log(data, log_time=log_time)

    def broadcast_time(self, now_ns: int) -> None:
        """Viewers show this as the current time."""
        self._server.broadcast_time(now_ns)

    def broadcast_playback(self, state: PlaybackState) -> None:
        """Viewers show this state of playing."""
        self._server.broadcast_playback_state(state)

    def close(self) -> None:
        """Ends all connections; safe to call twice."""
        self._relay.close()
        self._server.stop()

    def repeat_last(self, channel_id: int) -> None:
        """Show the last message of a latched channel again, as a viewer has just asked for it."""
        if self._on_subscribe is not None:
            self._on_subscribe()
        with self._lock:
            served = self._by_id.get(channel_id)
        if served is not None and served.last is not None:
            data, log_time = served.last
            served.channel.log(data, log_time=log_time)

    def _served(self, channel: ChannelSpec) -> _Served:
        with self._lock:
            if channel not in self._channels:
                made = _Served(self._open(channel))
                self._channels[channel] = self._by_id[made.channel.id()] = made
            return self._channels[channel]

    def _open(self, channel: ChannelSpec) -> Channel:
        import foxglove

        schema = foxglove.Schema(name=channel.schema_name, encoding=channel.schema_encoding, data=channel.schema_data)
        return foxglove.Channel(
            channel.topic,
            message_encoding=channel.message_encoding,
            schema=schema if channel.schema_name or channel.message_encoding != "json" else None,
            metadata=dict(channel.metadata),
            context=self._context,
        )
