"""Callbacks of the Foxglove SDK for subscriptions and playback; imported only where the SDK is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import final

from foxglove.websocket import ChannelView, Client, PlaybackControlRequest, PlaybackState, ServerListener


@final
class Listener(ServerListener):
    """Passes on the two calls that matter here; they come in threads of the SDK.

    Args:
        on_subscribe: called with the id of a channel that a viewer subscribes to.
        on_control: answers a viewer that plays, pauses, seeks or changes the speed.
    """

    def __init__(
        self,
        on_subscribe: Callable[[int], None],
        on_control: Callable[[PlaybackControlRequest], PlaybackState | None] | None,
    ) -> None:
        self._on_subscribe, self._on_control = on_subscribe, on_control

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self._on_subscribe(channel.id)

    def on_playback_control_request(self, playback_control_request: PlaybackControlRequest) -> PlaybackState | None:
        return None if self._on_control is None else self._on_control(playback_control_request)
