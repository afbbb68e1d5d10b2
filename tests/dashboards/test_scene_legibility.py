"""What a person must recognise at a glance in the panels: whose row it is, which container, the action, its cost."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from matplotlib.figure import Figure
from PIL import Image
from toy import BED
from toy_run import action, named_run, ns, other_run, toy_run

from dashboards.capsule.run_data import TextTable, run_data
from dashboards.figures.cost_over_time import draw_cost_over_time
from dashboards.figures.files import MAPS, _belief_maps, write_figures
from dashboards.figures.floor_plan import draw_floor_plan
from dashboards.figures.trajectory import draw_trajectory
from dashboards.model.clock import Clock
from dashboards.model.labels import action_words, humanize_ids, label
from dashboards.model.phases import describe
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.palette import css, run_colour
from dashboards.panels.beliefs import beliefs
from dashboards.panels.chart import MAX_BAND_RATIO, Band, Line, chart
from dashboards.panels.comparison import comparison, divergences
from dashboards.panels.find_costs import find_costs
from dashboards.panels.markup import breakable, number, text
from dashboards.panels.now import legend, now, run_signs, title
from dashboards.panels.phase_strip import strip
from dashboards.viser_app.panel.controls import SLIDER_STEPS, slider_scale
from replayers.runs.run import read
from workbench.worlds.house import ContainerId

SAMPLES = Path(__file__).parents[2] / "logs"
OURS, OTHER = timeline_of(toy_run()), timeline_of(other_run())


def test_each_row_of_the_strip_has_its_runs_colour_before_it() -> None:
    made = strip(Clock(timelines=(OURS, OTHER)), ["lios", "<greedy>"], [run_colour(0), run_colour(1)])
    whose = made[made.index('class="whose"') : made.index('class="strip"')]
    assert re.findall(r'background:(#\w+)" title="([^"]*)"', whose) == [
        (css(run_colour(0)), "lios"),
        (css(run_colour(1)), "&lt;greedy&gt;"),
    ]


def test_a_run_alone_needs_no_mark_before_its_row() -> None:
    assert "whose" not in strip(Clock(timelines=(OURS,)), ["lios"], [run_colour(0)])


def test_containers_of_one_kind_are_told_apart_in_the_table_of_beliefs() -> None:
    made = beliefs(scene_at(OURS, ns(1)), OURS)
    for container in OURS.plan.containers:
        assert f"<small>{container.id.partition('|')[2]}</small>" in made


def test_a_container_of_a_site_goes_by_its_kind_and_its_own_name() -> None:
    first = OURS.plan.containers[0]
    own = {"couch": "sofa <small>couch</small>", "sofa": "sofa</span>", "sofa_2": "sofa <small>sofa 2</small>"}
    for name, words in own.items():
        renamed = (replace(first, id=ContainerId(name), type="Sofa"), *OURS.plan.containers[1:])
        place = replace(OURS.run.place, plan=replace(OURS.plan, containers=renamed))
        site = timeline_of(replace(OURS.run, place=place))
        assert words in beliefs(scene_at(site, ns(1)), site)


@pytest.mark.parametrize(
    ("name", "types", "words"),
    [
        ("boil", ("Egg", "Pot"), "boil egg in pot at countertop 2"),
        ("pour-water", ("WaterBottle", "Pot"), "pour water from water bottle into pot at countertop 2"),
        ("make-coffee", ("CoffeeGrinds", "Pot"), "make coffee from coffee grinds in pot at countertop 2"),
        ("pour-coffee", ("Pot", "Mug"), "pour coffee from pot into mug at countertop 2"),
        ("toast", ("Bread", "Toaster"), "toast bread in toaster at countertop 2"),
        ("peel", ("Apple", "Knife"), "peel apple with knife at countertop 2"),
        ("find", ("Mug",), "find mug, bring to countertop 2"),
        ("pick", ("Mug",), "pick mug at countertop 2"),
        ("boil", ("Egg",), "boil egg at countertop 2"),
        ("juggle {}", ("Egg", "Mug"), "juggle {} egg mug at countertop 2"),
    ],
)
def test_an_action_reads_as_a_sentence(name: str, types: tuple[str, ...], words: str) -> None:
    assert action_words(name, types, "CounterTop|2") == words


def test_what_was_done_reads_like_what_was_planned() -> None:
    boiled = action(1, 1, "boil", 0, 5, "CounterTop|2", item_types=("Egg", "Pot"), items=("Egg|1", "Pot|1"))
    assert describe(boiled) == "boil egg in pot at countertop 2"


def test_items_and_one_word_containers_are_told_too() -> None:
    assert humanize_ids("found WaterBottle in dining_table", {"WaterBottle", "dining_table"}) == (
        "found water bottle in dining table"
    )
    assert humanize_ids("found WaterBottle") == "found WaterBottle"
    assert "found mug in countertop 1" in now(scene_at(OURS, ns(7.5)))


def test_the_task_is_told_with_names_for_people() -> None:
    named = replace(OURS.run, task=replace(OURS.run.task, title="find Mug, bring it to DiningTable|2|0"))
    assert "find mug, bring it to dining table 2|0" in title(timeline_of(named))


def test_a_run_that_is_over_does_not_wait() -> None:
    words = now(scene_at(OURS, OURS.end_ns))
    assert "waiting" not in words
    assert "done" in words


def test_the_legend_stays_the_same_while_a_run_plays() -> None:
    """Its panel is fitted to it: a line more or less would move the strip above it."""
    moments = [ns(s) for s in (0, 1, 5, 8, 13)] + [OURS.end_ns]
    assert len({legend(scene_at(OURS, stamp)) for stamp in moments}) == 1


def test_what_a_find_elsewhere_would_cost_is_said_of_what_the_plan_does() -> None:
    """The fridge costs 6 more than the start, to which the plan brings the mug."""
    assert "no, to start instead (6.0 cheaper)" in find_costs(scene_at(OURS, ns(1)), "start")


def test_a_run_that_failed_says_why_and_what_it_is_charged() -> None:
    """It had spent 9.5; the task's failure costs 400."""
    outcome = msgspec.structs.replace(OURS.run.outcome, status="failed", cost=400.0, reason="no Mug in Fridge|1 <b>")
    failed = timeline_of(replace(OURS.run, outcome=outcome))
    assert "Ended because: no mug in fridge 1 &lt;b&gt;. Charged: 400.0." in now(scene_at(failed, failed.end_ns))
    assert "RunEnded" not in now(scene_at(failed, ns(5)))
    assert "RunEnded" not in now(scene_at(OURS, OURS.end_ns))


def test_a_name_does_not_turn_the_numbers_after_it_around() -> None:
    """After a right-to-left override "400.0" would read "0.004"."""
    assert text("a\u202eb\u2067c") == "a\ufffdb\ufffdc"
    assert text("עברית <") == "עברית &lt;"


def test_a_number_of_very_many_digits_is_told_by_its_power_of_ten() -> None:
    assert [number(v) for v in (3.5e12, -2.25e6, 999_999.0, math.inf)] == ["3.50e12", "-2.25e6", "999999.0", "inf"]


def test_a_very_long_name_is_shortened_in_the_view_and_in_tables() -> None:
    rooms = tuple(replace(room, kind="x" * 300) for room in OURS.plan.rooms)
    long = timeline_of(replace(OURS.run, place=replace(OURS.run.place, plan=replace(OURS.plan, rooms=rooms))))
    visible = re.sub(r'title="[^"]*"', "", beliefs(scene_at(long, ns(1)), long))
    clock = Clock(timelines=(long, OTHER))
    visible += re.sub(r'title="[^"]*"', "", comparison(clock, [scene_at(long, ns(1))] * 2, ["x" * 300, "b"]))
    visible += re.sub(r'title="[^"]*"', "", divergences(clock, ["x" * 300, "b"]))
    assert max(len(word) for word in re.findall(r">(x+)", visible)) < 30
    assert label("x" * 300) == "x" * 39 + "…"
    ax = Figure().subplots()
    draw_floor_plan(ax, long.plan)
    assert {len(words.get_text()) for words in ax.texts} == {40}


def test_the_cost_plot_of_a_figure_tells_an_end_from_a_stop_and_keeps_its_key_off_the_lines() -> None:
    """The other run is a replay that ended undetermined: its last cost is not what it costs."""
    ax = Figure().subplots()
    draw_cost_over_time(ax, [OURS, OTHER, OTHER, OTHER])
    ends = [line.get_marker() for line in ax.lines if len(line.get_xdata()) == 1 and line.get_markersize() == 5]
    assert ends == ["o", "X", "X", "X"]
    key = ax.get_legend()
    assert [t.get_text() for t in key.get_texts()][:2] == ["lios", "greedy #2 (undetermined)"]
    ax.figure.draw_without_rendering()
    assert key.get_window_extent().y1 < ax.get_window_extent().y0


@pytest.mark.ci
def test_a_figure_of_a_strategy_with_a_very_long_name_keeps_its_shape(tmp_path: Path) -> None:
    """Its name may be a planner's own, module and class; nothing else would be left to see."""
    timelines = [timeline_of(named_run("x" * 400)), OTHER]
    write_figures(timelines, tmp_path, formats=("png",))
    for path in tmp_path.glob("*.png"):
        with Image.open(path) as image:
            assert image.width < 2400, path.name
            assert image.width < 5 * image.height, path.name


def _chart(band_high: float) -> str:
    line = Line(name="a", colour="#111111", points=[(0.0, 0.0), (10.0, 100.0)])
    band = Band(name="b", colour="#222222", from_reading=5.0, low=50.0, high=band_high)
    stopped = Line(name="b", colour="#222222", points=[(0.0, 0.0), (5.0, 50.0)])
    shown = lambda value, _: f"{value:.0f}"  # noqa: E731
    return chart("cost", [line, stopped], end=10.0, unit="s", shown=shown, bands=[band])


def test_a_wide_band_does_not_flatten_the_lines() -> None:
    """A line that ends at 100 in a chart of up to 5000 would be one of 2 pixels."""
    made = _chart(5000.0)
    marks = [float(m) for m in re.findall(r'px">([\d.]+)</span>', made)]
    assert max(marks) == MAX_BAND_RATIO * 100
    assert "b: 50 to 5000 by the log" in made
    y, height = (float(v) for v in re.findall(r'<rect [^>]* y="([-\d.]+)"[^>]* height="([\d.]+)"', made)[0])
    assert y < 0 < y + height


def test_a_band_that_fits_sets_the_scale_and_a_run_has_one_key() -> None:
    made = _chart(120.0)
    assert max(float(m) for m in re.findall(r'px">([\d.]+)</span>', made)) == 120
    keys = re.findall(r"</span>([^<]+)</span>", made[made.index('class="legend"') :])
    assert keys == ["a", "b: 50 to 120 by the log"]


def test_a_long_place_may_break_at_its_joints_and_stays_text() -> None:
    assert breakable("multi_room:44") == "multi_<wbr>room:<wbr>44"
    assert "<img" not in breakable("<img src=x_y>")
    assert breakable("_" * 500).count("<wbr>") == 0


@pytest.mark.parametrize(
    ("end", "step", "digits"), [(236.961, 0.1, 2), (50.61, 0.01, 3), (3600.0, 1.0, 1), (0.0, 1e-6, 6)]
)
def test_the_time_fits_its_field(end: float, step: float, digits: int) -> None:
    assert slider_scale(end) == (pytest.approx(step), digits)
    assert end == 0 or 200 <= end / step <= 10 * SLIDER_STEPS


def test_the_legend_tells_of_a_replays_end_before_it_comes() -> None:
    ended = timeline_of(replace(OURS.run, outcome=msgspec.structs.replace(OURS.run.outcome, unseen=BED)))
    assert ended.ends_unseen
    assert not OURS.ends_unseen
    made = run_data(ended, "lios", run_colour(0), texts := TextTable(), signs=run_signs([ended]))
    legends = {texts.all[look[4]] for frame in made["frames"] for look in frame["looks"][:1]}
    assert len(legends) == 1
    assert "◆" in legends.pop()


def test_the_start_of_a_way_lies_on_top_of_all_ways() -> None:
    ax = Figure().subplots()
    draw_trajectory(ax, [OURS, OTHER])
    start = next(line for line in ax.lines if line.get_marker() == "o")
    assert start.get_zorder() > max(other.get_zorder() for other in [*ax.lines, *ax.texts] if other is not start)


def test_belief_maps_stand_at_even_distances() -> None:
    figure = _belief_maps(timeline_of(read(SAMPLES / "find-lios.mcap")), "Mug")
    figure.draw_without_rendering()
    maps = [ax.get_window_extent() for ax in figure.axes[:MAPS]]
    gaps = [b.x0 - a.x1 for a, b in itertools.pairwise(maps)]
    assert len(gaps) == MAPS - 1
    assert max(gaps) - min(gaps) < 1.0
