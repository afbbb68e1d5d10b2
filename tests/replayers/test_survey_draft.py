"""A survey drafted from a recording can be loaded, and agrees with the place that was driven."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from sample_logs import write_toy_log

from replayers.sites import survey_draft as site_drafts
from replayers.sites.survey_draft import NothingToDraft, draft_site, write_draft
from workbench.cli import run as lios
from workbench.worlds.house import LocationId
from workbench.worlds.sites.check import check_site
from workbench.worlds.sites.site import Site, load_site

sys.path.insert(0, str(Path(__file__).parent / "importers"))


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot driven to three containers, recorded without a survey."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "recorders" / "spot"))
    from spot_help import placed, robot

    from recorders.run_recorder import RunRecorder
    from recorders.spot.client.control import Control
    from recorders.spot.record_session import session_info
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.run.site_tasks import place_of, session_task
    from recorders.spot.run.world import SpotWorld
    from recorders.spot.session.session import Rates, Session
    from workbench.search.costs import ROBOT_COSTS
    from workbench.worlds.sites.site import unsurveyed_site

    log = tmp_path_factory.mktemp("driven") / "round.mcap"
    unknown, task = unsurveyed_site(), session_task()
    with robot() as (_spot, connection), Control(connection, own_estop=True) as control:
        world = SpotWorld(connection=connection, control=control, site=placed()[0], settings=RunSettings(look_s=4.0))
        world.localize()
        with RunRecorder(
            log, info=session_info(connection, unknown, task), place=place_of(unknown), task=task, costs=ROBOT_COSTS
        ) as recorder:
            session = Session(connection, unknown, recorder.sink, rates=Rates(images_hz=0.0, grid_hz=0.0))
            connection.clock.on_step = session.tick  # type: ignore[attr-defined]
            for name in ("couch", "countertop", "dining_table", "couch"):
                world.go_to(LocationId(name))
                world.wait(0.25)
                for _ in range(20):
                    world.wait(0.25)
            connection.clock.on_step = None  # type: ignore[attr-defined]
    return log


@pytest.mark.ci
def test_a_drive_without_a_survey_drafts_one(driven: Path, home: Site, tmp_path: Path) -> None:
    draft = draft_site(driven)
    assert [stop.waypoint for stop in draft.stops] == ["wp-couch", "wp-countertop", "wp-dining-table"]
    assert set(draft.tags) == {101, 102}
    assert draft.tags[102][:2] == pytest.approx((1.5, 1.0), abs=0.05)
    names = ("couch", "countertop", "dining_table")
    for i, a in enumerate(names):
        pose = home.paths.standing_pose(LocationId(a))
        assert pose is not None
        assert (draft.stops[i].pose.x_m, draft.stops[i].pose.y_m) == pytest.approx(pose.point, abs=0.05)
        for j, b in enumerate(names):
            metres = home.travel.between(LocationId(a), LocationId(b))
            assert draft.metres[i + 1, j + 1] == pytest.approx(metres, abs=0.8)
    site = load_site(write_draft(draft, tmp_path / "site", name="drafted"))
    assert site.travel_source == "measured"
    assert site.travel.unreachable == ()
    assert not [finding for finding in check_site(site) if finding.level == "error"]


def test_containers_of_a_known_place_keep_their_names(home: Site, tmp_path: Path) -> None:
    from bag_writing import Ros1Bag

    from replayers.importers.bags import open_bag
    from replayers.importers.import_bag import ImportPlan, import_bag
    from replayers.importers.mapping import load_mapping

    Ros1Bag(tmp_path / "trial.bag").write(home)
    with open_bag(tmp_path / "trial.bag") as bag:
        plan = ImportPlan(site=home, mapping=load_mapping("paper", bag.topics), strategy="")
        import_bag(bag, plan, tmp_path / "trial.mcap")
    draft = draft_site(tmp_path / "trial.mcap")
    assert [stop.name for stop in draft.stops] == ["countertop", "dining_table", "bed"]
    site = load_site(write_draft(draft, tmp_path / "site", name="again"))
    assert site.grid is not None
    assert site.travel_source == "map"


def test_a_log_without_poses_says_so(tmp_path: Path) -> None:
    from recorders.sinks.files import LogFiles

    files = LogFiles(tmp_path / "empty.mcap")
    files.close()
    with pytest.raises(NothingToDraft, match="/robot/pose"):
        draft_site(tmp_path / "empty.mcap")


def test_a_simulated_run_is_no_survey_and_leaves_no_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write_toy_log(tmp_path / "toy.mcap")
    assert lios(["site", "from-log", str(log), "-o", str(tmp_path / "site")]) == 2
    said = capsys.readouterr()
    assert "no robot's session" in said.err
    assert said.err.count("\n") == 1
    assert not (tmp_path / "site").exists()


@pytest.mark.ci
def test_a_robot_that_stood_nowhere_leaves_nothing_to_draft(driven: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site_drafts, "DWELL_S", 3600.0)
    with pytest.raises(NothingToDraft, match="stood nowhere for 3600 s"):
        draft_site(driven)


def test_tags_of_the_map_on_walls_and_docks_are_not_taken_for_items(driven: Path, tmp_path: Path) -> None:
    draft = draft_site(driven)
    assert set(draft.other_tags) == {540}, "it hangs at the start, where nothing stands"
    assert not set(draft.tags) & set(draft.other_tags)
    item = min(draft.tags)
    told = draft_site(driven, map_tags=frozenset({item}))
    assert set(told.other_tags) == {540, item}
    text = write_draft(told, tmp_path / "home", name="home").read_text(encoding="utf-8")
    assert "Tags left out" in text
    assert f"Item|{item}" not in text
