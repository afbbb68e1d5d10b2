"""Which container, had it been opened, would have settled the most over the trials of a selection, and in words."""

from __future__ import annotations

from collections.abc import Sequence

from replayers.batch.next_look import SharedLook, looks_by_log, shared_looks
from replayers.batch.replays import Replays
from replayers.selection.campaign_logs import TrialGroup

LOOKS_SHOWN = 3
SETTLES_SHOWN = 0.005
"""What a look is expected to settle is shown with two decimals; less than that is none."""


def looks_of_trials(made: Replays, groups: Sequence[TrialGroup]) -> tuple[SharedLook, ...]:
    """The containers of all trials that count, the most informative first, for the candidates that are judged."""
    judged = {str(log): group.trials[0].strategies for group in groups for log in group.logs}
    replays = [r for r in made if r.strategy in judged.get(r.log, ())]
    logs = [log for group in groups for log in group.logs]
    return shared_looks(looks_by_log(replays, logs, made.settings))


def look_lines(looks: Sequence[SharedLook], *, trials: int, worlds: int) -> tuple[str, ...]:
    """The looks that are expected to settle something, one line each; or one line that says why there is none.

    Args:
        trials: how many count.
        worlds: drawn for each.
    """
    telling = [look for look in looks if look.settles >= SETTLES_SHOWN][:LOOKS_SHOWN]
    if telling:
        return tuple(
            f"look next into {look.container} in {look.place}: unopened in {look.logs} of {trials} logs, "
            f"expected to settle {look.settles:.2f} of {look.doubt:.2f} doubtful comparisons"
            for look in telling
        )
    return (f"no look is advised: {_why_none(looks, worlds)}",)


def _why_none(looks: Sequence[SharedLook], worlds: int) -> str:
    if not worlds:
        return "what a look would show is judged by drawn worlds, and --worlds is 0"
    if not looks:
        return "no candidate looks into a container that was left unopened, or no worlds could be drawn"
    if all(look.doubt < SETTLES_SHOWN for look in looks):
        return "in the drawn worlds it is not doubtful which candidate costs less on these trials"
    return "no single one is expected to settle a doubtful comparison of candidates"
