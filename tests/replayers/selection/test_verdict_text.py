"""What a verdict says in words: what it rests on, and why the one to drive is not the cheapest so far."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
from known_costs import trial

from replayers.selection.trial_costs import PriorCosts, TrialCosts
from replayers.selection.verdict import SelectionSettings, verdict_after
from replayers.selection.verdict_text import summary

SETTINGS = SelectionSettings()
OPEN = trial([30, 50, 50], [inf, 50, 50], driven="b", estimate=[55, 50, 50])


def said(trials: list[TrialCosts], settings: SelectionSettings = SETTINGS) -> str:
    return summary(verdict_after(trials, settings), alpha=settings.alpha)


def test_one_that_is_driven_for_its_start_says_so_and_who_has_a_bound() -> None:
    prior = PriorCosts(mean=np.array([40.0, 50.0, 50.0]), variance=25.0)
    words = said([replace(OPEN, prior=prior)])
    assert "Drive a next. There is no bound on how much more than others it cost" in words
    assert "; of b it is known: at most 20.0 a trial more than any other." in words
    assert "On these trials b is expected to have cost less (50.0, not 55.0), but by what was to be expected" in words


def test_one_that_is_driven_because_it_is_uncertain_says_so() -> None:
    words = said([trial([10, 50, 60], [60, 50, 60], estimate=[51, 50, 60])])
    assert "Drive a next." in words
    assert "(50.0, not 51.0), but the cost of a is less certain, so that driving it shows more." in words


def test_the_cheapest_needs_no_reason() -> None:
    words = said([trial([20, 25, 60], [20, 30, 60], estimate=[20, 28, 60])])
    assert "is expected to have cost less" not in words
    assert "it is known" not in words


def test_settled_by_proof_says_on_which_cap_it_rests() -> None:
    """A run that succeeds may cost more than a failure is charged: then the lead can be made up after all."""
    ahead = [trial([10, 40, 60], [10, 45, 90])] * 9
    words = said(ahead, SelectionSettings(horizon=10))
    assert "Settled by proof: with each trial counted up to its failure cost (of those to come at most 100)" in words
    dear = trial([350, 20, 95], [350, 20, 95])
    assert verdict_after([*ahead, dear], SelectionSettings(horizon=10)).next == "b"  # so the condition is needed
