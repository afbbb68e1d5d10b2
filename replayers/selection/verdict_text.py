"""A verdict in words, as the command and the dashboard say it."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

from replayers.selection.verdict import SelectionVerdict, Settled, StrategyStanding
from workbench.tolerances import NEAR_COST, NEAR_SHOWN_COST


def summary(last: SelectionVerdict, *, alpha: float) -> str:
    """What to drive next, what it may cost at most, and whether that is settled."""
    if len(last.standings) == 1:
        return f"Drive {last.next} next: no other candidate ran over every one of these logs."
    words = f"Drive {last.next} next. "
    if last.regret_so_far < inf:
        words += f"On the trials so far it cost at most {last.regret_so_far:.1f} a trial more than any other"
    else:
        words += "There is no bound on how much more than others it cost on the trials so far"
    if last.regret_to_come < last.regret_to_come_unknown - NEAR_COST:
        sure = f"{100 * (1 - alpha):g} % confidence"
        words += f"; in the mean of trials like these, at most {last.regret_to_come:.1f} ({sure})"
    words += "."
    if last.settled is not Settled.NO:
        return f"{words} Settled {last.settled}: more trials do not change the answer."
    if last.trials_to_settle is not None and last.trials_to_settle > 0:
        return f"{words} Not settled; about {last.trials_to_settle} more trials like these would settle it."
    return f"{words} Not settled; these trials do not show how many more are needed."


def standing_words(name: str, last: SelectionVerdict) -> str:
    """Why a strategy is to be driven, or is not."""
    if name == last.next:
        return "drive next"
    if any(e.strategy == name for e in last.by_sequence):
        return "out by sequence"
    proof = next((e for e in last.by_proof if e.strategy == name), None)
    if proof is not None:
        return f"out by proof: {proof.margin:.1f} or more above {proof.by} in all"
    return "the same so far" if name in last.same else "open"


def mean_cost(standing: StrategyStanding) -> str:
    """From the mean lower to the mean upper bound; one figure where they are the same."""
    if standing.upper - standing.lower < NEAR_SHOWN_COST:
        return f"{standing.lower:.1f}"
    return f"{standing.lower:.1f} to {f'{standing.upper:.1f}' if standing.upper < inf else 'no upper bound'}"


def at_most(value: float) -> str:
    return f"{value:.1f}" if value < inf else "unknown"


def out_of_choice(not_replayed: Mapping[str, str]) -> tuple[str, ...]:
    """The candidates that could be replayed over no log, one line for each reason."""
    of: dict[str, list[str]] = {}
    for name, why in not_replayed.items():
        of.setdefault(why, []).append(name)
    return tuple(f"left out of the choice: {', '.join(names)}: {why}" for why, names in of.items())
