"""Plug-in planners: failures are statuses with a reason, and the truth is out of their reach."""

from __future__ import annotations

from pathlib import Path

import pytest
from toy import BED
from toy_logs import toy_run

from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_on
from replayers.counterfactual.sandbox import AskedForTruth, HiddenTruth, Sandboxed, is_foreign, load_foreign
from workbench.errors import UnknownName
from workbench.execution.events import RunStatus
from workbench.planning.strategies import strategy_plugin
from workbench.plugins import NameOrigin, NotFromLog


def test_one_that_behaves_is_replayed_like_any_other(tmp_path: Path) -> None:
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=20))
    made = replay_on(prepared, "misbehaving:Behaves", origin=NameOrigin.USER)
    assert made.strategy == "behaves"
    assert made.status is RunStatus.DONE
    assert made.cost == 11.0
    assert made.exact


@pytest.mark.ci_but(5)
@pytest.mark.parametrize(
    ("planner", "reason"),
    [
        ("misbehaving:Raises", "it raised ValueError: no idea"),
        ("misbehaving:RaisesLines", "it raised ValueError: first second"),
        ("misbehaving:Interrupts", "it raised KeyboardInterrupt"),
        ("misbehaving:Hangs", "it made no decision within 0.3 s"),
        ("misbehaving:Dies", "its process died"),
        ("misbehaving:AnswersNonsense", "it returned str instead of a Decision"),
        ("misbehaving:CostsNoNumber", "its plan's cost is not a finite number"),
        ("misbehaving:Teleports", "illegal step"),
        ("misbehaving:peeking", "it asks for the truth (house.contents)"),
        ("misbehaving:NOT_A_STRATEGY", "it raised TypeError"),
        ("misbehaving:Missing", "it raised AttributeError"),
        ("no_such_module:Planner", "it raised ModuleNotFoundError"),
    ],
)
def test_misbehaving_is_a_status_with_its_reason(tmp_path: Path, planner: str, reason: str) -> None:
    prepared = prepare_log(
        toy_run(tmp_path), ReplaySettings(worlds=0, timeout_s=0.3 if "Hangs" in planner else 120.0)
    )
    made = replay_on(prepared, planner, origin=NameOrigin.USER)
    assert made.status is RunStatus.PLANNER_FAILED
    assert reason in made.reason
    assert (made.bounds, made.cost, made.exact) == (None, None, False)


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(
    ("planner", "reason"),
    [("RaisesLater", "it raised ValueError: no idea of beds"), ("HangsLater", "no decision within")],
)
def test_breaking_only_where_the_log_cannot_tell_is_told_and_nothing_claimed(
    tmp_path: Path, planner: str, reason: str
) -> None:
    """Over the log alone it stops at the bed, undetermined; beyond it no world gets a cost."""
    prepared = prepare_log(
        toy_run(tmp_path), ReplaySettings(worlds=20, timeout_s=1.0 if "Hangs" in planner else 120.0)
    )
    made = replay_on(prepared, f"misbehaving:{planner}", origin=NameOrigin.USER, worlds=("best", "worst", "drawn"))
    assert made.unseen == BED
    assert made.status is RunStatus.PLANNER_FAILED
    assert reason in made.reason
    assert f"after it looked into {BED}, which nobody opened" in made.reason
    assert (made.bounds, made.estimate, made.drawn, made.cost, made.exact) == (None, None, None, None, False)
    assert not made.worlds


@pytest.mark.ci
def test_a_process_that_died_is_started_again_but_not_for_ever(tmp_path: Path) -> None:
    with Sandboxed("misbehaving:Dies", origin=NameOrigin.USER) as planner:
        view = None
        for _ in range(5):
            assert planner.decide(view).plan.note.startswith("its process died")  # type: ignore[arg-type]
        assert planner.fault is not None
        assert "not tried again" in planner.fault.reason


def test_loading_tells_asking_for_the_truth_from_other_mistakes() -> None:
    with pytest.raises(AskedForTruth, match=r"house\.contents"):
        load_foreign(strategy_plugin("misbehaving:peeking", origin=NameOrigin.USER))
    assert not HiddenTruth()
    with pytest.raises(TypeError):
        load_foreign(strategy_plugin("misbehaving:NOT_A_STRATEGY", origin=NameOrigin.USER))


def test_which_names_come_from_outside() -> None:
    assert is_foreign("some_module:Planner", origin=NameOrigin.USER)
    with pytest.raises(NotFromLog, match="some_module:Planner"):
        is_foreign("some_module:Planner", origin=NameOrigin.LOG)
    for origin in NameOrigin:
        assert not is_foreign("ModelLIOS", origin=origin)
        assert not is_foreign("model-lios@command:planner {domain} {problem} {plan}", origin=origin)
        with pytest.raises(UnknownName, match="model-lios"):
            is_foreign("model-lio", origin=origin)


def test_what_a_planner_prints_is_no_part_of_the_answer(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Standard output may be read by a machine (--json)."""
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=0))
    assert replay_on(prepared, "misbehaving:Prints", origin=NameOrigin.USER).exact
    told = capfd.readouterr()
    assert told.out == ""
    assert "what I think" in told.err
    assert "what my library thinks" in told.err
