"""The end of a command over logs that are not whole: a line for each on standard error, and exit code 3."""

from __future__ import annotations

from collections.abc import Mapping

import click

from workbench.terminal import say


def end_with_losses(lost: Mapping[str, tuple[str, ...]]) -> None:
    """Says what is missing from each log.

    Raises:
        click.exceptions.Exit: with 3, where anything is missing.
    """
    from replayers.runs.gaps import loss_lines

    for line in loss_lines(lost):
        say(line)
    if lost:
        raise click.exceptions.Exit(3)
