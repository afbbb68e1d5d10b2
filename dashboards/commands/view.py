"""`lios view`: the dashboard in a browser, for logs or a folder of logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from workbench.parameters import Argument, Option


def view(
    logs: Annotated[list[Path], Argument(help="Logs of one task to show together, or a folder of logs.")],
    port: Annotated[int, Option(help="Port to listen on; 0 takes any free one.")] = 8080,
    host: Annotated[
        str, Option(help="Address to listen on; by default, only this machine can connect.")
    ] = "127.0.0.1",
    at: Annotated[float, Option(help="Seconds after the start at which to begin.")] = 0.0,
    follow: Annotated[bool, Option("--follow", help="Show a run while it is being recorded.")] = False,
    ghosts: Annotated[
        str,
        Option(help="With --follow: strategies to replay beside the run, separated by commas."),
    ] = "",
    memory: Annotated[
        bool, Option("--memory", help="Also show where each item was seen over days, in logs of one place.")
    ] = False,
    no_token: Annotated[
        bool, Option("--no-token", help="Admit every program on this machine; refused for other addresses.")
    ] = False,
) -> None:
    """Look at runs in 3D in a browser.

    Several logs are overlaid on one clock; a folder opens as a table of its runs. The printed address
    contains a token; requests without it are refused.

    Examples:

        lios view run.mcap

        lios view lios.mcap greedy.mcap --at 12.5

        lios view logs/

        lios view logs/ --memory

        lios view --follow run.mcap

        lios view --follow run.mcap --ghosts model-lios,pes-greedy
    """
    from dashboards.viser_app.serving import show_until_stopped

    lost = show_until_stopped(
        logs, host=host, port=port, at=at, follow=follow, token=not no_token, memory=memory, ghosts=ghosts
    )
    if lost:
        raise click.exceptions.Exit(3)
