"""The end of a command over logs that are not whole: a line for each on standard error, and exit code 3."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from workbench.terminal import say

if TYPE_CHECKING:
    from replayers.runs.gaps import LogLosses


def end_with_losses(found: LogLosses, *, unreadable: int = 0) -> None:
    """Says what is missing from each log.

    Args:
        unreadable: how many logs were left out, each with a line of its own, because they cannot be read.

    Raises:
        click.exceptions.Exit: with 3, where anything had to be dropped or left out; the missing end of a log that was
            cut off between two records is only said.
    """
    for line in found.lines:
        say(line)
    if found.lost or unreadable:
        raise click.exceptions.Exit(3)
