"""`lios serve`: plays logs to Foxglove, Lichtblick and other viewers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.parameters import Argument, Option


def serve(
    logs: Annotated[list[Path], Argument(help="Logs to play on one clock.")],
    port: Annotated[int, Option(help="Port to listen on; 0 takes any free one.", min=0, max=65535)] = 8765,
    host: Annotated[
        str, Option(help="Address to listen on; by default, only this machine can connect.")
    ] = "127.0.0.1",
    speed: Annotated[float, Option(help="Seconds of the log per second.")] = 1.0,
    loop: Annotated[bool, Option("--loop", help="Begin again at the end.")] = False,
    paused: Annotated[bool, Option("--paused", help="Wait until a viewer presses play.")] = False,
    origin: Annotated[
        list[str] | None,
        Option("--origin", help="A website besides Foxglove's whose pages may connect; may be repeated."),
    ] = None,
) -> None:
    """Play logs to Foxglove, Lichtblick and others over Foxglove's WebSocket protocol.

    Playing starts when the first viewer subscribes; viewers with controls can pause, seek and change the speed.

    Examples:

        lios serve run.mcap

        lios serve lios.mcap greedy.mcap --speed 4 --loop
    """
    import threading

    from recorders.foxglove.live_server import ServedAt
    from replayers.serving.player import Player
    from workbench.terminal import say

    player = Player(
        logs, ServedAt(host=host, port=port, origins=tuple(origin or ())), speed=speed, loop=loop, paused=paused
    )
    try:
        # Said in here: whoever reads it may press Ctrl-C at once.
        say(
            f"Playing at {player.server.address} (Ctrl-C stops it). "
            "In the viewer: open connection, Foxglove WebSocket."
        )
        threading.Event().wait()
    except KeyboardInterrupt:
        say("Stopped.")  # as requested: not a failure
    finally:
        player.close()
