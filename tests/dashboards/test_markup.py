"""Panels of the toy run: their content, and that markup in names is shown and never run."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import msgspec
import pytest
from markupsafe import Markup
from toy import COUNTER, FRIDGE
from toy_run import empty_run, named_run, ns, other_run, toy_run

from dashboards.model.clock import ALIGNMENTS, Clock
from dashboards.model.replay_bounds import ReplayBounds
from dashboards.model.run_names import run_names
from dashboards.model.scene import scene_at
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.palette import run_colour
from dashboards.panels.beliefs import beliefs
from dashboards.panels.comparison import comparison, divergences, mismatches
from dashboards.panels.find_costs import find_costs
from dashboards.panels.folder.runs import RunRow, passes, runs
from dashboards.panels.folder.scatter import pairs, scatter
from dashboards.panels.markup import name, number, percent, table
from dashboards.panels.now import legend, now, title
from dashboards.panels.phase_strip import cursor, strip
from dashboards.panels.plan import plan
from dashboards.panels.plots import belief_plot, cost_plot

OURS, OTHER, EMPTY = timeline_of(toy_run()), timeline_of(other_run()), timeline_of(empty_run())
NASTY = """<img src=x onerror="alert('ran')"></script><script>alert(1)</script> & 'q' 日本 |"""


class _Elements(HTMLParser):
    """The elements and attributes of some markup."""

    def __init__(self, markup: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.text = ""
        self.feed(markup)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {key for key, _ in attrs}

    def handle_data(self, data: str) -> None:
        self.text += data


def everything(timeline: Timeline, second: float = 1.0) -> str:
    """All panels of a run at a moment."""
    clock = Clock(timelines=(timeline, OTHER))
    scenes = [scene_at(t, s) for t, s in zip(clock.timelines, clock.stamps(second), strict=True)]
    names = [t.run.info.strategy for t in clock.timelines]
    row = _row(0, strategy=names[0], place=timeline.run.info.place, file=names[0])
    return "".join(
        (
            title(timeline),
            now(scenes[0]),
            legend(scenes[0]),
            beliefs(scenes[0], timeline),
            plan(scenes[0]),
            find_costs(scenes[0], "start"),
            cost_plot(clock, names),
            belief_plot(clock, scenes[0].focus),
            comparison(clock, scenes, names),
            divergences(clock, names),
            mismatches(clock),
            strip(clock, names, [run_colour(0), run_colour(1)]),
            cursor(clock, second),
            runs([row], (0,), total=1),
            scatter([row, _row(1, strategy="b")], names[0], "b"),
        )
    )


def _row(index: int, **more: object) -> RunRow:
    given: dict[str, object] = {
        "file": f"{index}.mcap",
        "place": "toy",
        "scenario": "find mug",
        "strategy": "a",
        "seed": 0,
        "source": "simulation",
        "outcome": "done",
        "cost": 10.0 + index,
        "searches": 2,
    }
    return RunRow(index=index, **(given | more))  # type: ignore[arg-type]


def test_names_are_shown_as_text_and_never_run() -> None:
    found = _Elements(everything(timeline_of(named_run(NASTY))))
    assert not found.tags & {"img", "script", "iframe", "a"}
    assert not {a for a in found.attributes if a.startswith("on")}
    assert "<img src=x" in found.text
    assert "日本" in found.text


@pytest.mark.parametrize("timeline", [OURS, OTHER, EMPTY], ids=["ours", "other", "empty"])
@pytest.mark.parametrize("second", [0.0, 4.0, 99.0])
def test_every_panel_says_something_of_every_run(timeline: Timeline, second: float) -> None:
    found = _Elements(everything(timeline, second))
    assert "nan" not in found.text.lower().split()
    assert "None" not in found.text


def test_beliefs_are_listed_most_believed_first_and_searched_ones_last() -> None:
    listed = re.findall(r'title="([^"|]+\|\d)"', beliefs(scene_at(OURS, ns(4.5)), OURS))
    assert listed[0] == COUNTER
    assert "× searched" in beliefs(scene_at(OURS, ns(4.5)), OURS)
    assert "40 %" in beliefs(scene_at(OURS, ns(1)), OURS)


def test_the_plan_shows_steps_order_and_ways_not_taken() -> None:
    words = _Elements(plan(scene_at(OURS, ns(1)))).text
    assert "find mug, bring to start" in words
    assert "look at the bed first" in words
    assert "farther" in words
    assert 'class="current"' in plan(scene_at(OURS, ns(13)))
    assert "No plan" in plan(scene_at(EMPTY, ns(1)))


def test_find_costs_are_those_from_where_the_robot_stood() -> None:
    words = _Elements(find_costs(scene_at(OURS, ns(1)), FRIDGE)).text
    assert "8.0" in words
    assert "16.0" in words
    assert "9.0" not in words
    assert "No find" in find_costs(scene_at(OURS, ns(5)), FRIDGE)


def test_a_simulated_robot_is_called_so_by_what_it_says_of_itself_and_not_by_what_its_log_holds() -> None:
    robot = replace(OURS.run, info=msgspec.structs.replace(OURS.run.info, source="spot"))
    assert " · Spot<" in title(timeline_of(robot))
    for says in ({"simulated": "true"}, {"serial": "simulated-spot"}):  # early logs have the serial number alone
        assert " · Spot (simulated)<" in title(timeline_of(replace(robot, robot=says, truth=None)))
    assert " · simulation<" in title(OURS)


def test_comparison_jumps_to_where_runs_part() -> None:
    clock = Clock(timelines=(OURS, OTHER))
    made = divergences(clock, ["lios", "greedy"])
    assert 'data-lios="seek 4.000000"' in made
    assert "after 2 shared actions" in made


def test_comparison_shows_bounds_where_the_log_does_not_decide() -> None:
    known = ReplayBounds(lower=6.0, upper=31.0, exact=False, estimate=12.0, interval90=(7.0, 20.0))
    clock = Clock(timelines=(OURS, timeline_of(other_run(), counterfactual=known)))
    scenes = [scene_at(t, s) for t, s in zip(clock.timelines, clock.stamps(15), strict=True)]
    assert "6.0 to 31.0" in comparison(clock, scenes, ["lios", "greedy"])
    assert "by the log: 6.0 to 31.0" in cost_plot(clock, ["lios", "greedy"])


def test_comparison_warns_of_other_places_and_tasks() -> None:
    clock = Clock(timelines=(OURS, timeline_of(named_run("elsewhere"))))
    words = _Elements(mismatches(clock)).text
    assert "different places" in words
    assert "different tasks" in words
    assert mismatches(Clock(timelines=(OURS, OTHER))) == ""


def test_a_run_that_is_still_being_recorded_is_not_called_cut_off() -> None:
    begun = timeline_of(replace(EMPTY.run, complete=False, outcome=None))
    assert "cut off" in title(begun)
    words = title(begun, followed=True)
    assert "is being recorded" in words
    assert "No decision has been made yet" in words
    assert "cut off" not in words
    assert "holds no" not in words
    assert "recorded" not in title(OURS, followed=True)


def test_a_cut_off_log_says_so() -> None:
    words = _Elements(title(EMPTY)).text
    assert "was cut off" in words
    assert "no decisions" in words
    assert "no beliefs" in words


@pytest.mark.parametrize("alignment", ALIGNMENTS)
def test_the_strip_has_every_phase_and_decision(alignment: str) -> None:
    clock = Clock(timelines=(OURS,), alignment=alignment)  # type: ignore[arg-type]
    made = strip(clock, ["lios"], [run_colour(0)])
    assert made.count("<title>move to") == 3
    assert made.count('class="mark"/>') == 3
    assert "left:100.000%" in cursor(clock, clock.end)


def test_filters_of_runs() -> None:
    row = _row(1, strategy="lios", place="house 7", cost=40.0)
    assert passes(row, "")
    assert passes(row, "LIOS house")
    assert passes(row, "cost<50 cost>30")
    assert not passes(row, "cost<40")
    assert not passes(row, "greedy")
    assert passes(row, "cost<x"), "half of a filter hides nothing"
    assert not passes(_row(2, cost=None), "cost<50")


def test_only_runs_of_the_same_trial_are_paired() -> None:
    rows = [_row(0), _row(1, strategy="b"), _row(2, strategy="b", seed=4), _row(3, place="elsewhere")]
    assert [(a.index, b.index) for a, b in pairs(rows, "a", "b")] == [(0, 1)]
    assert 'data-lios="open 0,1"' in scatter(rows, "a", "b")
    assert "No task" in scatter(rows, "a", "c")


def test_numbers_for_people() -> None:
    assert (number(None), number(float("nan")), number(1.25)) == ("–", "–", "1.2")
    assert (percent(0.0123), percent(0.5), percent(None)) == ("1.2 %", "50 %", "–")


def test_long_names_are_shortened_with_the_whole_at_hand() -> None:
    long = "x" * 500 + "<b>"
    made = name(long)
    assert "&lt;b&gt;" in made
    assert len(_Elements(made).text) == 80


def test_table_cells_are_markup_and_heads_are_text() -> None:
    made = table(("<b>",), [[Markup("<i>1</i>")]], key="k")
    assert "&lt;b&gt;" in made
    assert "<i>1</i>" in made


def test_the_strip_names_its_unit_once() -> None:
    """In a narrow window "120 s" and "140 s" would run into each other."""
    made = strip(clock := Clock(timelines=(timeline_of(toy_run()),)), ["lios"], [run_colour(0)])
    labels = re.findall(r"<text[^>]*>([^<]*)</text>", made)
    assert labels[0] == "0 s"
    assert all(float(label) <= clock.end * 1.001 for label in labels[1:])


def test_more_runs_than_colours_have_their_numbers_on_the_timeline_and_at_the_lines() -> None:
    clock = Clock(timelines=(timeline_of(toy_run()),) * 12)
    names = run_names([t.run for t in clock.timelines])
    drawn = strip(clock, names, [run_colour(i) for i in range(12)])
    assert ">12</span>" in drawn
    assert ">12</span>" in cost_plot(clock, names)
    few = Clock(timelines=clock.timelines[:3])
    assert ">3</span>" not in strip(few, names[:3], [run_colour(i) for i in range(3)]) + cost_plot(few, names[:3])
