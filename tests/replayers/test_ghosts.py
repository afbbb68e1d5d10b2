"""Ghosts beside a growing log: bounds that only narrow and end at those of the whole log, and what ends them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest
from growing import grown
from sample_logs import record_run, toy_events, toy_info, toy_options, write_toy_log

from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.live.ghost_bounds import GhostBounds, GhostReport, GhostVerdict, verdict
from replayers.live.ghosts import AnotherRun, Ghosts, ghost_log
from replayers.runs.run import read
from workbench.errors import LiosError
from workbench.tolerances import NEAR_COST

LOGS = Path(__file__).parents[2] / "logs"
GHOSTS = ("pes-greedy", "conditioned-lios")


def _rounds(ghosts: Ghosts, log: Path, copy: Path) -> Iterator[GhostReport]:
    """One round after each chunk of a log."""
    for _ in grown(log, copy):
        try:
            report = ghosts.next_round()
        except LiosError:
            continue  # its attachments are not on disk yet
        if report is not None:
            yield report


def _checked(log: Path, copy: Path, output: Path | None = None) -> tuple[dict[str, GhostBounds], list[GhostReport]]:
    """The last bounds of every strategy, once those of all rounds are seen to narrow towards the whole log's."""
    reports = list(_rounds(Ghosts(copy, GHOSTS, output=output, clock=lambda: 0.0, max_segments=60), log, copy))
    assert not any(report.note for report in reports if report.bounds), [r.note for r in reports]
    last: dict[str, GhostBounds] = {}
    for report in reports:
        for now in report.bounds:
            before = last.get(now.strategy)
            assert not now.trouble
            if before is not None:
                assert now.lower >= before.lower
                assert now.upper <= before.upper
                assert now.least_extra >= before.least_extra
                assert now.most_extra <= before.most_extra
            last[now.strategy] = now
    prepared = prepare_log(read(log), ReplaySettings(worlds=0, budget=Budget(segments=120, draws=0)))
    for name, kept in last.items():
        whole = replay_on(prepared, name).bounds
        assert whole is not None
        assert kept.lower <= whole.least_found + NEAR_COST
        assert kept.upper >= whole.largest_found - NEAR_COST
        if whole.exact:
            assert (kept.lower, kept.upper) == pytest.approx((whole.lower, whole.upper))
    return last, reports


def test_bounds_narrow_to_those_of_the_whole_log(tmp_path: Path) -> None:
    """The toy run: whoever looks where the driven one did finds the mug on the counter, and pays 11 as it did."""
    log = write_toy_log(tmp_path / "run.mcap")
    last, reports = _checked(log, tmp_path / "copy.mcap", tmp_path / "ghosts")
    assert list(last) == ["model-lios", *GHOSTS]
    assert last["model-lios"].driven
    assert reports[0].note == "Waiting for the first decision."
    first = next(report for report in reports if report.bounds)
    assert first.bounds[0].upper > first.bounds[0].lower
    assert last["model-lios"].exact
    assert last["model-lios"].lower == pytest.approx(11.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["find-greedy", "find-lios", "deliver-3", "breakfast", "spot-home-A", "spot-home-B"])
def test_bounds_over_the_beginnings_of_shipped_logs_hold_for_the_whole(name: str, tmp_path: Path) -> None:
    _checked(LOGS / f"{name}.mcap", tmp_path / "copy.mcap")


@pytest.mark.slow
def test_the_driven_strategy_is_provably_beaten_once_the_mug_is_found(tmp_path: Path) -> None:
    """find-greedy: model-lios would have gone to the dresser first and paid at least 31.9, at most 37.5, not 43.7."""
    log, copy = LOGS / "find-greedy.mcap", tmp_path / "copy.mcap"
    reports = list(_rounds(Ghosts(copy, ("model-lios",), clock=lambda: 0.0, max_segments=60), log, copy))
    verdicts = [verdict(report.bounds) for report in reports if report.bounds]
    assert verdicts[0] is GhostVerdict.OPEN
    assert verdicts[-1] is GhostVerdict.BEATEN
    assert verdicts == sorted(verdicts, key=[GhostVerdict.OPEN, GhostVerdict.BEATEN].index)
    assert reports[-1].line.startswith("opt-greedy is provably beaten: model-lios costs at least 6.2 less")


def test_ghosts_are_recorded_as_replays_with_their_bounds(tmp_path: Path) -> None:
    from replayers.batch.store import read_replay

    log = write_toy_log(tmp_path / "run.mcap")
    last, _ = _checked(log, tmp_path / "copy.mcap", tmp_path / "ghosts")
    for name in GHOSTS:
        path = ghost_log(tmp_path / "ghosts", name)
        run, kept = read(path), read_replay(path.with_suffix(".json")).bounds
        assert run.info.strategy == name
        assert run.info.source == "replay"
        assert kept is not None
        assert (kept.lower, kept.upper) == (last[name].lower, last[name].upper)


def test_nothing_new_is_no_round_and_the_end_is_told(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    ghosts = Ghosts(log, GHOSTS, clock=lambda: 0.0, max_segments=60)
    reports = [ghosts.next_round() for _ in range(20)]
    said = [report for report in reports if report is not None]
    assert said[-1].ended == "The run has ended."
    assert [report.ended for report in said[:-1]] == [""] * (len(said) - 1)
    assert reports[-1] is None


def test_a_strategy_that_cannot_be_replayed_is_bounded_by_what_it_spent(tmp_path: Path) -> None:
    """A person drove: 1 m walked so far is the least, and the whole 11 once it has ended."""
    log = tmp_path / "run.mcap"
    record_run(log, toy_events(), **{**toy_options(), "info": toy_info(strategy="by hand")})
    driven = [r.bounds[0] for r in _rounds(Ghosts(tmp_path / "c.mcap", GHOSTS), log, tmp_path / "c.mcap") if r.bounds]
    assert [b.strategy for b in driven[:1]] == ["by hand"]
    assert driven[0].upper == inf
    assert [b.lower for b in driven] == sorted(b.lower for b in driven)
    assert (driven[-1].lower, driven[-1].upper) == (11.0, 11.0)


def test_another_run_or_task_under_the_same_name_ends_the_ghosts(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    ghosts = Ghosts(log, GHOSTS, clock=lambda: 0.0, max_segments=60)
    assert ghosts.next_round() is not None
    task = toy_options()["task"]
    changed = {**toy_options(), "task": replace(task, failure_cost=500.0)}  # type: ignore[type-var]
    record_run(log, toy_events(), force=True, **changed)
    with pytest.raises(AnotherRun, match="another run"):
        ghosts.next_round()
