"""A verdict in words, as the command and the dashboard say it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
    words += _of_the_safest(last) + "." + _why_not_the_cheapest(last)
    if last.settled is Settled.BY_PROOF:
        cap = f"its failure cost (of those to come at most {last.regret_to_come_unknown:g})"
        return (
            f"{words} Settled by proof: with each trial counted up to {cap}, those to come do not change the answer."
        )
    if last.settled is Settled.BY_SEQUENCE:
        return f"{words} Settled by sequence: more trials like these do not change the answer."
    if last.trials_to_settle is not None and last.trials_to_settle > 0:
        return f"{words} Not settled; about {last.trials_to_settle} more trials like these would settle it."
    return f"{words} Not settled; these trials do not show how many more are needed."


def _of_the_safest(last: SelectionVerdict) -> str:
    """Who has the least bound on its regret, where the one to drive next has none."""
    safest = min(last.standings, key=lambda s: s.regret_so_far)
    if last.regret_so_far < inf or safest.regret_so_far == inf:
        return ""
    return f"; of {safest.strategy} it is known: at most {safest.regret_so_far:.1f} a trial more than any other"


def _why_not_the_cheapest(last: SelectionVerdict) -> str:
    """The reason why a strategy is to be driven although another one is expected to have cost less so far."""
    out = {e.strategy for e in last.by_proof}
    open_ones = [s for s in last.standings if s.strategy not in out]
    driven = next(s for s in last.standings if s.strategy == last.next)
    best = min(open_ones, key=lambda s: s.expected, default=driven)
    if best.expected > driven.expected - NEAR_SHOWN_COST:
        return ""
    words = f" On these trials {best.strategy} is expected to have cost less ({best.expected:.1f}, not "
    words += f"{driven.expected:.1f}), "
    if driven.to_come < best.to_come - NEAR_SHOWN_COST:
        come = f"({driven.to_come:.1f}, not {best.to_come:.1f})"
        return (
            f"{words}but by what was to be expected at their starts, {last.next} costs less in trials to come {come}."
        )
    return f"{words}but the cost of {last.next} is less certain, so that driving it shows more."


def expected_cost(standing: StrategyStanding) -> str:
    """The expected mean cost; named as such where it is but the middle of the bounds."""
    return f"{standing.expected:.2f}" + (" (middle)" if standing.middles else "")


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


def beliefs_apart(beliefs: Iterable[str]) -> tuple[str, ...]:
    """Why groups are apart by whose beliefs are followed, and how they are judged together; no line where they are
    not."""
    names = tuple(dict.fromkeys(name for name in beliefs if name))
    if not names:
        return ()
    return (
        f"The logs hold the beliefs of {', '.join(names)}: a strategy that follows others is another planner, so "
        "that their trials do not count together. With --estimator NAME all follow the same.",
    )
