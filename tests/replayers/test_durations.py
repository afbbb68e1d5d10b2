"""Durations fitted to a log: by hand, with residuals, and never a negative time."""

from __future__ import annotations

import msgspec
import pytest
from toy_logs import acted

from replayers.counterfactual.durations import SIMULATED, fitted_durations
from workbench.execution.events import ActionEnded
from workbench.log_schema.events import ActionFinished, Stamp
from workbench.planning.plans import PlanStep
from workbench.worlds.house import LocationId


def took(action: str, seconds: float, metres: float = 0.0) -> ActionFinished:
    end = Stamp.of(acted(action, "x").start.ns + round(seconds * 1e9))
    return msgspec.structs.replace(acted(action, "x"), stamp=end, travel_m=metres)


def done(action: str) -> ActionEnded:
    here = LocationId("x")
    step = PlanStep(action=action, origin=here, target=here)
    return ActionEnded(stamp_ns=1, decision=1, index=1, start_ns=0, step=step, cost=0.0, success=True)


def test_a_straight_line_is_found_exactly() -> None:
    """3 s to get going and 2 s a metre; looks 4 and 6 s; handling 10 s."""
    fitted = fitted_durations(
        [took("move", 3 + 2 * m, m) for m in (1.0, 2.0, 5.0)]
        + [took("search", 4), took("search", 6), took("pick", 10)]
    )
    assert fitted.move_s == pytest.approx(3.0)
    assert fitted.metre_s == pytest.approx(2.0)
    assert fitted.look_s == pytest.approx(5.0)
    assert fitted.manipulation_s == pytest.approx(10.0)
    assert dict(fitted.residual_s) == pytest.approx({"move": 0.0, "look": 1.0, "manipulation": 0.0}, abs=1e-9)
    assert dict(fitted.samples) == {"move": 3, "look": 2, "manipulation": 1}
    assert fitted.move_ns(2.0) == 7_000_000_000
    assert fitted.move_ns(0.0) == 0


def test_a_fit_that_would_start_before_zero_goes_through_zero() -> None:
    fitted = fitted_durations([took("move", 1.0, 1.0), took("move", 2.5, 2.0), took("move", 8.0, 5.0)])
    assert fitted.move_s == 0.0
    assert fitted.metre_s == pytest.approx((1 + 5 + 40) / 30)
    assert dict(fitted.residual_s)["move"] > 0


def test_what_was_never_done_takes_the_simulators_time() -> None:
    assert fitted_durations([]).look_s == SIMULATED.look_s
    assert fitted_durations([]).move_ns(3.0) == 3_000_000_000
    assert dict(fitted_durations([]).samples)["move"] == 0


def test_what_failed_is_not_measured() -> None:
    failed = msgspec.structs.replace(took("search", 60), success=False)
    assert fitted_durations([took("search", 4), failed]).look_s == pytest.approx(4.0)


def test_an_error_is_told_only_where_the_log_shows_a_spread() -> None:
    """Looks of 4 and 6 s leave 1 s each; one pick leaves nothing to tell by, and no move was made."""
    fitted = fitted_durations([took("search", 4), took("search", 6), took("pick", 10)])
    look, pick, move = (done(name) for name in ("search", "pick", "move"))
    assert fitted.spread_s([look, look, look, look]) == pytest.approx(2.0)
    assert fitted.spread_s([]) == 0.0
    assert fitted.spread_s([look, pick]) is None
    assert fitted.spread_s([look, move]) is None
    assert "a move 0.0 s and 1.00 s a metre (assumed: the log has none)" in fitted.words()
    assert "a look 5.0 s (residual 1.0 s over 2)" in fitted.words()
