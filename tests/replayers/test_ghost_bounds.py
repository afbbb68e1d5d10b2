"""What bounds of a growing log keep and prove; all figures by hand."""

from __future__ import annotations

from math import inf

from replayers.live.ghost_bounds import GhostBounds, GhostVerdict, tightened, verdict, verdict_line

DRIVEN = GhostBounds(strategy="opt-greedy", driven=True, lower=20.0, upper=30.0)


def _ghost(name: str = "model-lios", *, least: float = -inf, most: float = inf) -> GhostBounds:
    return GhostBounds(strategy=name, lower=10.0, upper=40.0, least_extra=least, most_extra=most)


def test_bounds_never_widen() -> None:
    before = GhostBounds(strategy="s", lower=10.0, upper=30.0, least_extra=-5.0, most_extra=4.0)
    wide = GhostBounds(strategy="s", lower=8.0, upper=35.0, outer=True, least_extra=-6.0, most_extra=3.0)
    kept = tightened(wide, before)
    assert (kept.lower, kept.upper, kept.least_extra, kept.most_extra) == (10.0, 30.0, -5.0, 3.0)
    assert kept.outer
    assert tightened(wide, None) is wide


def test_bounds_that_met_are_exact_however_wide_the_next_ones_are() -> None:
    before = GhostBounds(strategy="s", lower=10.0, upper=12.0)
    kept = tightened(GhostBounds(strategy="s", lower=12.0, upper=inf, outer=True), before)
    assert kept.exact
    assert not kept.outer


def test_a_strategy_that_broke_keeps_no_bounds() -> None:
    broken = GhostBounds(strategy="s", trouble="it raised")
    assert tightened(broken, GhostBounds(strategy="s", lower=1.0, upper=2.0)) is broken


def test_beaten_is_proven_by_one_ghost_that_costs_less_in_every_world() -> None:
    bounds = (DRIVEN, _ghost("pes-greedy", least=-3.0, most=8.0), _ghost(least=6.25, most=12.0))
    assert verdict(bounds) is GhostVerdict.BEATEN
    assert verdict_line(bounds) == (
        "opt-greedy is provably beaten: model-lios costs at least 6.2 less, whatever the unopened containers hold."
    )


def test_best_is_proven_only_against_all_ghosts() -> None:
    equal, worse, open_ = _ghost("a", least=0.0, most=0.0), _ghost("b", least=-9.0, most=-1.0), _ghost("c", most=0.5)
    assert verdict((DRIVEN, equal, worse)) is GhostVerdict.BEST
    assert "no more than a, b," in verdict_line((DRIVEN, equal, worse))
    assert verdict((DRIVEN, equal, worse, open_)) is GhostVerdict.OPEN
    assert verdict_line((DRIVEN, open_)).startswith("Open: opt-greedy is neither")


def test_a_ghost_without_bounds_proves_nothing() -> None:
    broken = GhostBounds(strategy="c", trouble="it raised")
    assert verdict((DRIVEN, _ghost(most=-1.0), broken)) is GhostVerdict.OPEN
    assert verdict((DRIVEN,)) is GhostVerdict.OPEN
    assert verdict_line((DRIVEN, broken)) == ""
