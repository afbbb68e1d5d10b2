"""Several runs on one clock, and where they diverge."""

from __future__ import annotations

import re

import pytest
from toy_run import empty_run, ns, other_run, toy_run

from dashboards.model.clock import ALIGNMENTS, Clock
from dashboards.model.divergence import divergence
from dashboards.model.timeline import timeline_of
from dashboards.panels.phase_strip import strip
from workbench.errors import BadValue

OURS, OTHER = timeline_of(toy_run()), timeline_of(other_run())


def test_by_time_a_run_that_is_over_stays_at_its_end() -> None:
    clock = Clock(timelines=(OURS, OTHER))
    assert clock.end == 15.0
    assert clock.stamps(12.0) == (ns(12.0), ns(9.0))


def test_by_distance_both_have_walked_as_far() -> None:
    clock = Clock(timelines=(OURS, OTHER), alignment="distance")
    assert clock.end == pytest.approx(6.0)
    # Ours walks 1 m until 2 s, then 1.5 m from 4 to 5 s; the other 5 m (4.96 by its corners) from 4 to 9 s.
    ours, other = clock.stamps(1.5)
    assert ours == pytest.approx(ns(4.0 + 0.5 / 1.5), abs=10_000)
    assert other == pytest.approx(ns(4.0 + 0.5 / 5.0 * 5), abs=10_000)


def test_by_decision_both_have_decided_as_often() -> None:
    clock = Clock(timelines=(OURS, OTHER), alignment="decision")
    assert clock.stamps(2.0) == (ns(4.0), ns(4.0))
    assert clock.stamps(3.0) == (ns(7.0), ns(9.0))
    assert clock.stamps(0.0) == (ns(0.0), ns(0.0))


def test_by_decision_a_strip_shows_all_that_was_done_between_two() -> None:
    """Ours decides at 0, 4 and 7 s and ends at 15 s; each decision is as wide as any other."""
    clock = Clock(timelines=(OURS, OTHER), alignment="decision")
    assert [clock.position(ns(s)) for s in (0, 2, 4, 7, 11, 15)] == pytest.approx([1.0, 1.5, 2.0, 3.0, 3.5, 4.0])
    assert Clock(timelines=(OURS,)).position(ns(5.0)) == 5.0
    empty = Clock(timelines=(timeline_of(empty_run()),), alignment="decision")
    assert 0.0 <= empty.position(ns(0.0)) <= empty.end
    made = strip(clock, ["ours", "other"], [(0, 0, 0), (1, 1, 1)])
    widths = [float(w) for w in re.findall(r'<rect x="[\d.]+%" y="14" width="([\d.]+)%"', made)]
    assert min(widths) > 3, "no phase of ours is a hair's breadth"


@pytest.mark.parametrize("alignment", ALIGNMENTS)
def test_readings_lead_back_to_decisions(alignment: str) -> None:
    clock = Clock(timelines=(OURS,), alignment=alignment)  # type: ignore[arg-type]
    for stamp in OURS.decision_ns[1:]:
        again = clock.stamps(clock.reading(stamp))[0]
        assert OURS.decision_at(again) == OURS.decision_at(stamp)


def test_another_alignment_is_refused() -> None:
    with pytest.raises(BadValue, match="time, distance, decision"):
        Clock(timelines=(), alignment="mood")  # type: ignore[arg-type]


def test_runs_part_at_their_first_different_action() -> None:
    found = divergence(OURS, OTHER)
    assert found is not None
    assert found.index == 2
    assert found.stamps_ns == (ns(4.0), ns(4.0))
    assert found.decisions == (2, 2)
    assert found.did == ("move to countertop 1", "move to bed 2")


def test_the_same_run_does_not_part_from_itself() -> None:
    assert divergence(OURS, OURS) is None


def test_a_run_that_was_cut_off_parts_where_it_ends() -> None:
    found = divergence(OURS, timeline_of(empty_run()))
    assert found is not None
    assert (found.index, found.did[1]) == (0, "nothing more")
