"""`lios record --sees`: what is seen in passing is in the log and known at once; without it nothing changes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from recorders.record_run import record
from replayers.batch.verify import verify
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.doctor.examine import examine
from replayers.evaluation.detection_trials import detection_trials
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from replayers.runs.state_at import moment_of
from workbench.cli import run as lios
from workbench.errors import Malformed
from workbench.execution.events import RunStatus
from workbench.log_schema.events import Observation
from workbench.log_schema.perception_json import perception_from_settings
from workbench.log_schema.sight_json import sight_from_settings
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.sight.lines_of_sight import LinesOfSight
from workbench.worlds.sight.sightings import stop_point


def recorded(path: Path, **options: object) -> Path:
    chosen = {"house": "houses:3", "find": "book", "estimator": "counts", "force": True, **options}
    end = record(path, **chosen)  # type: ignore[arg-type]
    assert end.status is RunStatus.DONE
    return path


def _said(path: Path) -> list[tuple[str, bytes]]:
    return [(m.topic, m.data) for m in messages(path) if "timing" not in m.topic]


def test_the_same_radius_gives_the_same_and_none_changes_nothing(tmp_path: Path) -> None:
    one, same, none, plain = (
        _said(recorded(tmp_path / f"{i}.mcap", **options))
        for i, options in enumerate(({"sees": 2.5}, {"sees": 2.5}, {"sees": 0.0}, {}))
    )
    assert one == same != plain
    assert none == plain
    assert not any(b'"passing"' in data for topic, data in plain if topic == "/search/observation")
    run = read(tmp_path / "3.mcap")
    assert "sight" not in run.settings
    assert sight_from_settings(run.settings) == 0.0


def test_sightings_are_told_with_their_viewpoint_and_hold_what_is_there(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.mcap", sees=4.0)
    run = read(path, with_truth=True)
    assert run.truth is not None
    assert sight_from_settings(run.settings) == 4.0
    lines = LinesOfSight(run.place.plan, 4.0)
    passed = [o for o in run.observations if o.passing is not None]
    assert any(o.known_at_start for o in passed)
    assert any(not o.known_at_start for o in passed)
    for seen in passed:
        assert seen.passing is not None
        assert seen.passing.how == "in passing"
        x_m, y_m, _ = seen.passing.viewpoint
        container = next(c for c in run.place.plan.containers if c.id == seen.container)
        assert lines.sees(container, (x_m, y_m))
        assert seen.items == run.truth.contents[seen.container]
    assert len({o.container for o in run.observations}) == len(run.observations)


def test_the_robot_stops_decides_anew_and_saves_way(tmp_path: Path) -> None:
    blind = read(recorded(tmp_path / "blind.mcap"))
    path = recorded(tmp_path / "run.mcap", sees=2.5)
    run = read(path)
    stops = [a for a in run.actions if stop_point(a.target) is not None]
    assert stops
    for stop in stops:
        assert stop.path[-1] == pytest.approx(stop_point(stop.target), abs=1e-3)
        later = next(plan for plan in run.plans if plan.decision == stop.decision + 1)
        assert later.robot_at == stop.target
        assert later.reason.startswith("saw ")
        view = moment_of(run, later.decision).view
        assert view.knowledge.robot_at == stop.target
        assert view.knowledge.travel.reaches(view.knowledge.robot_at)
        assert view.belief.containers == view.knowledge.unsearched
    assert run.outcome is not None
    assert blind.outcome is not None
    assert run.outcome.cost < blind.outcome.cost
    assert examine(path).verdict == "fine"


def test_tasks_of_several_items_are_done_and_fine(tmp_path: Path) -> None:
    path = recorded(tmp_path / "run.mcap", house="houses:4", find="", scenario="deliver-3", sees=2.5)
    run = read(path)
    assert any(o.passing is not None and not o.known_at_start for o in run.observations)
    travel = navigate(run.place.plan).travel
    for action in run.actions:
        assert travel.reaches(action.target) or stop_point(action.target) is not None  # type: ignore[arg-type]
    assert examine(path).verdict == "fine"


@pytest.mark.parametrize("radius", ["-1", "nan", "1000"])
def test_bad_radii_are_refused(tmp_path: Path, radius: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.mcap"
    assert lios(["record", "--find", "mug", "--sees", radius, "-o", str(path)]) == 2
    assert "--sees" in capsys.readouterr().err
    assert not path.exists()


def test_what_is_passed_can_be_missed_and_is_a_look_that_counts(tmp_path: Path) -> None:
    """The robot passes the book, misses it, and finds it when it looks there."""
    path = recorded(tmp_path / "run.mcap", house="houses:0", sees=4.0, miss_rate=0.6, strategy="robust-lios")
    run = read(path, with_truth=True)
    assert run.truth is not None
    assert (sight_from_settings(run.settings), perception_from_settings(run.settings).p_detect) == (4.0, 0.4)
    looks = Counter[str]()
    missed = dict[str, Observation]()
    for seen in run.observations:
        there = {item.id for item in run.truth.contents[seen.container]}
        if seen.known_at_start:
            assert seen.look is None
            assert {item.id for item in seen.items} == there, "the view from the start misses nothing"
            continue
        assert seen.look is not None
        looks[seen.container] += 1
        assert (seen.look.number, set(seen.look.p_detect)) == (looks[seen.container], {0.4})
        if seen.passing is not None:
            assert seen.look.viewpoint == seen.passing.viewpoint
            assert looks[seen.container] == 1, "a container is seen in passing once"
            if not any(item.type == "Book" for item in seen.items):
                missed[seen.container] = seen
    assert missed
    first = next(b for b in run.beliefs if b.decision == next(iter(missed.values())).decision + 1)
    assert any(first.probability[0][first.containers.index(c)] > 0 for c in missed if c in first.containers)
    assert verify(run).same
    assert examine(path).verdict == "fine"
    assert [(t.made, t.detected) for t in detection_trials(run)] == [("in passing", False), ("look", True)]


def test_memory_and_sight_go_together(tmp_path: Path) -> None:
    earlier = recorded(tmp_path / "logs" / "a.mcap", sees=2.5, day=1)
    later = recorded(tmp_path / "b.mcap", sees=2.5, memory=[tmp_path / "logs"])
    run, alone = read(later), read(earlier)
    assert sight_from_settings(run.settings) == 2.5
    assert "memory" in run.settings
    assert run.outcome is not None
    assert alone.outcome is not None
    assert run.outcome.cost < alone.outcome.cost, "the book is where it was seen"
    assert verify(run).same
    assert replay_on(prepare_log(run, ReplaySettings(worlds=0)), "sight-lios").exact


def test_sight_in_a_site_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.mcap"
    site = "paper_home"
    assert lios(["record", "--house", site, "--find", "cell phone", "--sees", "2", "-o", str(path)]) == 2
    assert "not for a surveyed site" in capsys.readouterr().err
    assert not path.exists()


@pytest.mark.parametrize("stored", [{"radius_m": -1.0}, {"radius_m": "far"}, 3])
def test_settings_that_name_no_radius_are_malformed(stored: object) -> None:
    with pytest.raises(Malformed, match="sight"):
        sight_from_settings({"sight": stored})
