"""`lios view`: the dashboard in a browser, for logs or a folder of logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def view(
    logs: Annotated[list[Path], typer.Argument(help="Logs of one task to show together, or a folder of logs.")],
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes any free one.")] = 8080,
    host: Annotated[
        str, typer.Option(help="Address to listen on; by default, only this machine can connect.")
    ] = "127.0.0.1",
    at: Annotated[float, typer.Option(help="Seconds after the start at which to begin.")] = 0.0,
    follow: Annotated[bool, typer.Option("--follow", help="Show a run while it is being recorded.")] = False,
) -> None:
    """Show runs in 3D in a browser.

    Several logs are overlaid on one clock; a folder opens as a table of its runs.

    Examples:

        lios view run.mcap

        lios view lios.mcap greedy.mcap --at 12.5

        lios view logs/

        lios view --follow run.mcap
    """
    from dashboards.viser_app.serving import show_until_stopped

    show_until_stopped(logs, host=host, port=port, at=at, follow=follow)
