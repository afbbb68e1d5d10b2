"""Correctness of what is shown: pairs of runs, paths there and back, axes, names, figures of one item."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure
from toy import COUNTER, toy_plan
from toy_run import ns, other_run, stamp, toy_run

import replayers
from dashboards.capsule.write import capsule_page
from dashboards.figures.comparison import draw_comparison
from dashboards.figures.cost_over_time import draw_cost_over_time
from dashboards.figures.files import write_figures
from dashboards.figures.gantt import draw_gantt
from dashboards.geometry.floors import CLEAR_M, floors
from dashboards.geometry.house import house_shape
from dashboards.geometry.marks import MAX_DASHES, dashes
from dashboards.model.belief_series import belief_series
from dashboards.model.clock import Clock
from dashboards.model.divergence import divergence
from dashboards.model.labels import humanize_ids, place_words
from dashboards.model.phases import describe, kind_of
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.panels.folder.runs import RunRow
from dashboards.panels.folder.scatter import pairs
from dashboards.panels.markup import axis_number
from dashboards.panels.now import now, title
from dashboards.panels.phase_strip import strip
from dashboards.viser_app.cameras import FIELD_OF_VIEW, fitted
from workbench.log_schema.events import Outcome
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container, ContainerId, FloorPlan, Room, RoomId

OURS = timeline_of(toy_run())
SAMPLES = Path(__file__).parents[2] / "logs"


def row(file: str, strategy: str, cost: float | None = 1.0, **more: object) -> RunRow:
    given: dict[str, object] = {
        "index": 0, "place": "home", "scenario": "deliver-2", "seed": 0, "source": "spot", "outcome": "done",
        "searches": 1,
    }  # fmt: skip
    return RunRow(file=file, strategy=strategy, cost=cost, **(given | more))


def test_a_robots_runs_pair_by_their_files() -> None:
    """Four configurations of one home: the same place, task and seed, told apart by their files alone."""
    rows = [row(f"home-{c}.mcap", "model-lios", 10.0 + i) for i, c in enumerate("AB")]
    rows += [row(f"home-{c}-pes-greedy.mcap", "pes-greedy", 20.0 + i) for i, c in enumerate("AB")]
    assert [(a.cost, b.cost) for a, b in pairs(rows, "pes-greedy", "model-lios")] == [(20.0, 10.0), (21.0, 11.0)]


def test_runs_that_cannot_be_told_apart_are_not_paired() -> None:
    rows = [row("first.mcap", "lios"), row("second.mcap", "lios"), row("third.mcap", "greedy")]
    assert pairs(rows, "lios", "greedy") == []
    assert len(pairs(rows[1:], "lios", "greedy")) == 1, "one of each needs no names"
    assert len(pairs([*rows[1:], row("x.mcap", "lios", None)], "lios", "greedy")) == 1, "cut off: no second run"
    told = [row("a.mcap", "lios", estimator="best@1"), row("b.mcap", "greedy", estimator="counts@2")]
    assert pairs(told, "lios", "greedy") == [], "each with beliefs of its own"


def test_there_and_back_along_one_line_is_dashed_once() -> None:
    way = np.array([[0.3, 0.1], [3.0, 1.0], [3.0, 4.0], [1.0, 5.0]])
    there, back = dashes(way, 0.1), dashes(way[::-1], 0.1)
    both = dashes(np.concatenate([way, way[::-1]]), 0.1)

    def as_set(made: np.ndarray) -> set[tuple[tuple[float, ...], ...]]:
        return {tuple(sorted(tuple(round(float(v), 3) for v in end) for end in dash)) for dash in made}

    assert as_set(there) == as_set(back) == as_set(both)


def test_a_leg_that_is_partly_walked_keeps_its_dashes() -> None:
    whole = dashes(np.array([[0.0, 0.0], [4.0, 2.0]]), 0.0)
    rest = dashes(np.array([[1.0, 0.5], [4.0, 2.0]]), 0.0)
    assert np.allclose(whole[-5:], rest[-5:], atol=1e-5)


def test_dashes_of_damaged_numbers_are_few() -> None:
    assert len(dashes(np.array([[0.0, 0.0], [9e6, 0.0]]), 0.0)) <= MAX_DASHES + 2
    assert len(dashes(np.array([[0.0, 0.0], [1e300, 0.0], [-1e308, 1.0]]), 0.0)) == 0


def test_a_rooms_name_stands_clear_of_its_containers() -> None:
    floor = ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0))
    table = Container(
        id=ContainerId("DiningTable|1|1"),
        type="DiningTable",
        room=RoomId("r"),
        pose=Pose(x_m=3.0, y_m=3.0),
        size_m=(1.0, 1.0, 0.7),
    )
    room = Room(id=RoomId("r"), kind="Kitchen", floor=floor)
    bare: dict[str, tuple[()]] = {"walls": (), "doors": (), "windows": (), "furniture": ()}
    plan = FloorPlan(name="p", rooms=(room,), containers=(table,), start=Pose(x_m=1.0, y_m=1.0), **bare)
    x, y = floors(plan)[0].label_at
    assert np.hypot(x - 3.0, y - 3.0) > CLEAR_M * 0.8
    assert 0.8 < x < 5.2
    assert 0.8 < y < 5.2
    empty = replace(plan, containers=())
    assert floors(empty)[0].label_at == pytest.approx((3.0, 3.0)), "with nothing in the way its middle"


def test_what_stands_over_tall_furniture_is_in_the_picture() -> None:
    shape = house_shape(toy_plan())
    tall = replace(shape, tops_m=tuple((x, y, 3.0) for x, y, _ in shape.tops_m))
    pose = fitted(tall)
    eye, at = np.array(pose.position), np.array(pose.look_at)
    ahead = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(ahead, [0, 0, 1.0])
    up = np.cross(right / np.linalg.norm(right), ahead)
    for top in tall.tops_m:
        away = np.array(top) - eye
        assert away @ up / (away @ ahead) < np.tan(FIELD_OF_VIEW / 2)


def test_marks_of_an_axis_can_be_told_apart() -> None:
    for top in (275.0, 12.0, 7.9, 1.0, 0.4):
        assert len({axis_number(share * top, top) for share in (0.0, 0.5, 1.0)}) == 3
    assert [axis_number(v, 275.0) for v in (0.0, 137.5, 275.0)] == ["0", "138", "275"]


def test_the_last_label_of_the_strip_fits() -> None:
    """Of 15 s every 2 s is marked; the mark at 14 s stands at 93.3 %."""
    made = strip(Clock(timelines=(OURS,)), ["lios"], [(0, 0, 0)])
    assert '<text x="93.33%" y="9" text-anchor="end">14</text>' in made
    assert '<text x="80.00%" y="9">12</text>' in made


def test_ids_are_told_as_people_say_them() -> None:
    assert place_words("DiningTable|4|1") == "dining table 4|1"
    assert place_words("start") == "start"
    assert humanize_ids("searched Fridge|3|1, then ArmChair|2|4.") == "searched fridge 3|1, then armchair 2|4."
    assert humanize_ids("a | b, x|y and <img src=x|1>") == "a | b, x|y and <img src=x 1>"
    assert "Decided because: searched fridge 1" in now(scene_at(OURS, ns(5)))
    first = OURS.actions[0]
    assert (describe(first), kind_of(first)) == ("move to fridge 1", "moving")


def test_a_task_of_many_goals_is_told_whole() -> None:
    run = toy_run()
    task = replace(run.task, title="deliver " + ", ".join(f"thing {i} to Fridge|1|{i}" for i in range(5)))
    words = title(timeline_of(replace(run, task=task)))
    assert "thing 4 to fridge 1|4" in words
    assert "…" not in words


def test_runs_without_plans_part_by_their_actions() -> None:
    """Bags tell what a robot did, not why."""
    bare = [replace(run, plans=(), beliefs=(), find_costs=()) for run in (toy_run(), other_run())]
    found = divergence(timeline_of(bare[0]), timeline_of(bare[1]))
    assert found is not None
    assert found.index == 2


def test_a_title_that_reads_like_a_placeholder_stays_a_title() -> None:
    run = toy_run()
    page = capsule_page([timeline_of(replace(run, task=replace(run.task, title="@DATA@ and @SCRIPT@")))])
    assert "<title>@DATA@ and @SCRIPT@</title>" in page


def test_belief_maps_side_by_side_are_of_one_item(monkeypatch: pytest.MonkeyPatch) -> None:
    from dashboards.figures import files

    shown: list[str] = []
    monkeypatch.setattr(files, "draw_belief_map", lambda _ax, _run, scene, *, scale: shown.append(scene.focus))
    files._belief_maps(OURS, "Plate")
    assert set(shown) == {"Plate"}


def test_a_map_of_one_item_shows_no_order_of_search_for_another(monkeypatch: pytest.MonkeyPatch) -> None:
    from dashboards.figures import files

    shown: list[tuple[int, bool]] = []
    monkeypatch.setattr(
        files, "draw_belief_map", lambda _ax, _run, s, *, scale: shown.append((s.decision, bool(s.search_order)))
    )
    timeline = timeline_of(replayers.read(SAMPLES / "spot-home-A.mcap"))
    files._belief_maps(timeline, "WaterBottle")
    assert shown[0] == (1, True)
    assert len(shown) > 2
    assert not any(ordered for _, ordered in shown[1:]), "then it is the cell phone that is looked for"


def test_a_belief_is_drawn_until_its_container_was_searched() -> None:
    from dashboards.figures.beliefs_over_time import draw_beliefs_over_time

    timeline = timeline_of(replayers.read(SAMPLES / "find-lios.mcap"))
    ax = Figure().subplots()
    draw_beliefs_over_time(ax, timeline, "Mug")
    first = next(line for line in ax.lines if line.get_label() == "countertop 3|0")
    assert list(first.get_xdata()) == [0.0, timeline.seconds(timeline.decision_ns[1])]
    assert len(set(first.get_ydata())) == 1


def test_the_words_of_a_scale_stand_off_the_walls() -> None:
    from dashboards.figures.trajectory import draw_trajectory

    figure = Figure(figsize=(5, 4))
    ax = figure.subplots()
    draw_trajectory(ax, [timeline_of(replayers.read(SAMPLES / "spot-home-A.mcap"))])
    figure.canvas.draw()
    words = next(text for text in ax.texts if text.get_text() == "2 m")
    assert words.get_window_extent().y1 <= ax.transData.transform((0, ax.get_ylim()[0]))[1]


def test_the_figures_item_is_what_the_first_decision_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """A log may begin before its first decision; then no plan is in force, and the alphabet would choose."""
    from dashboards.figures import files

    run = toy_run()
    first = min(run.observations, key=lambda o: o.stamp.ns)
    early = msgspec.structs.replace(first, stamp=stamp(-3.0), known_at_start=True, container=COUNTER)
    beliefs = tuple(
        msgspec.structs.replace(
            b, item_types=("Apple", *b.item_types), probability=(b.probability[0], *b.probability)
        )
        for b in run.beliefs
    )
    timeline = timeline_of(replace(run, observations=(early, *run.observations), beliefs=beliefs))
    asked: list[str] = []
    monkeypatch.setattr(files, "_belief_maps", lambda _t, focus: asked.append(focus) or Figure())
    for draw in files._drawings([timeline]).values():
        with matplotlib.rc_context({"backend": "agg"}):
            draw()
    assert asked == ["Mug"]


def test_a_failed_run_says_what_it_was_charged() -> None:
    run = toy_run()
    assert run.outcome is not None
    failed: Outcome = msgspec.structs.replace(run.outcome, status="budget spent", cost=400.0)
    ax = Figure().subplots()
    draw_comparison(ax, [timeline_of(replace(run, outcome=failed)), OURS])
    words = [text.get_text() for text in ax.texts]
    assert "budget spent (charged 400.0)" in words[0]
    assert "charged" not in words[1]


def test_what_was_expected_is_drawn_to_the_end_and_says_whose_it_is() -> None:
    ax = Figure().subplots()
    draw_cost_over_time(ax, [OURS, timeline_of(other_run())])
    line = next(line for line in ax.lines if str(line.get_label()).startswith("expected in all by"))
    assert line.get_xdata()[-1] == pytest.approx(OURS.duration_s)


def test_rows_of_the_gantt_chart_are_in_the_order_of_their_first_action() -> None:
    ax = Figure().subplots()
    draw_gantt(ax, OURS)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["move", "search", "pick"]


def test_series_of_belief_are_the_same_for_panel_and_figure() -> None:
    series = belief_series(OURS, "Mug")
    tops = [max(p for _, p in points) for points in series.values()]
    assert tops == sorted(tops, reverse=True)
    assert belief_series(OURS, "Unheard") == {}


def test_a_log_of_an_address_family_of_its_own_is_opened() -> None:
    from dashboards.viser_app.server import Dashboard

    for host, named in (("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "127.0.0.1"), ("::1", "[::1]"), ("::", "[::1]")):
        server = SimpleNamespace(get_host=lambda host=host: host, get_port=lambda: 8080)
        assert Dashboard(server).url == f"http://{named}:8080"  # pyright: ignore[reportArgumentType]


@pytest.mark.ci
def test_figures_are_the_same_bytes_again(tmp_path: Path) -> None:
    folder = tmp_path
    for name in ("a", "b"):
        write_figures([OURS], folder / name, formats=("svg",))
    for path in (folder / "a").iterdir():
        assert path.read_bytes() == (folder / "b" / path.name).read_bytes()
