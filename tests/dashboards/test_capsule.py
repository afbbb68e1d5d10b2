"""The offline page: complete, safe, small, and the same for the same runs."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from toy_run import empty_run, named_run, other_run, toy_run

from dashboards.capsule.write import capsule_page, write_capsule
from dashboards.model.containers.seen_items import items_seen
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from workbench.errors import BadValue, OutputExists

OURS, OTHER = timeline_of(toy_run()), timeline_of(other_run())


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="text/plain">([^<]*)</script>', page)
    assert found
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def test_the_page_holds_both_runs_and_loads_nothing() -> None:
    page = capsule_page([OURS, OTHER])
    data = data_of(page)
    assert [run["name"] for run in data["runs"]] == ["lios", "greedy"]
    assert data["runs"][0]["decisions"] == [0.0, 4.0, 7.0]
    assert data["runs"][1]["imputed"] == [5, 6]
    assert "default-src 'none'" in page
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", page)
    assert "@DATA@" not in page


def test_frames_stand_at_every_change() -> None:
    run = data_of(capsule_page([OURS]))["runs"][0]
    assert run["frameS"] == [0.0, 2.0, 4.0, 5.0, 7.0, 12.0, 15.0]
    assert run["marks"][run["frames"][-1]["looks"][0][2]]["tick"] == [1]
    assert run["orders"][run["frames"][0]["order"]] == [0, 1, 4]


def test_items_goals_and_the_end_of_a_replay_are_there_as_in_the_dashboard() -> None:
    data = data_of(capsule_page([OURS, OTHER]))
    ours, other = data["runs"]
    balls = [ours["balls"][frame["items"]] for frame in ours["frames"]]
    assert [len(b) for b in balls] == [len(items_seen(OURS, OURS.stamp(s))) for s in ours["frameS"]]
    goals = [sum(wanted for *_, wanted in b) for b in balls]
    assert goals == [0, 0, 0, 0, 1, 0, 0], "the mug is seen at 7 s and taken at 12 s"
    assert ours["itemNames"][ours["frames"][4]["looks"][0][5]][0][0] == "mug"
    assert len(data["house"]["goals"]) == 1
    assert ours["stop"] is None
    assert other["stop"] == [OTHER.duration_s, int(np.flatnonzero(scene_at(OTHER, OTHER.end_ns).unseen)[0])]
    legend = data["texts"][ours["frames"][0]["looks"][0][4]]
    for words in ("◆", "assumed by a replay", "another run", "item seen", "place of the goal", "? nobody"):
        assert words in legend


def test_the_same_runs_give_the_same_bytes() -> None:
    assert capsule_page([OURS, OTHER]) == capsule_page([timeline_of(toy_run()), timeline_of(other_run())])


def test_markup_in_names_stays_inside_the_data() -> None:
    nasty = "</script><script>alert(1)</script>"
    page = capsule_page([timeline_of(named_run(nasty))])
    assert page.count("<script") == 2
    assert "alert(1)" not in page.replace("&lt;/script&gt;&lt;script&gt;alert(1)&lt;/script&gt;", "")
    assert data_of(page)["runs"][0]["name"] == nasty


def test_runs_of_another_place_are_left_out_and_the_page_says_so() -> None:
    page = capsule_page([OURS, timeline_of(named_run("elsewhere"))])
    assert len(data_of(page)["runs"]) == 1
    assert "Left out, being of another place" in data_of(page)["title"]
    assert "Left out" not in data_of(capsule_page([OURS, OTHER]))["title"]


def test_each_item_can_be_chosen_with_its_own_beliefs() -> None:
    data = data_of(capsule_page([OURS]))
    run = data["runs"][0]
    assert run["items"] == ["mug", "plate"], "the goal's first"
    automatic, mug, plate = run["frames"][0]["looks"]
    assert automatic == mug
    assert run["palettes"][mug[0]] != run["palettes"][plate[0]]
    assert "plate" in data["texts"][plate[4]]
    assert len(data["still"]["plots"]) == 3


def test_what_no_run_opened_is_marked_where_a_replay_is_among_them() -> None:
    assert data_of(capsule_page([OURS]))["unopened"] == []
    assert data_of(capsule_page([OURS, OTHER]))["unopened"] == [3, 4]


def test_a_log_without_anything_gives_a_page() -> None:
    data = data_of(capsule_page([timeline_of(empty_run())]))
    assert data["runs"][0]["frameS"] == [0.0]
    assert data["house"]["names"]


def test_no_runs_are_refused() -> None:
    with pytest.raises(BadValue, match="at least one"):
        capsule_page([])


def test_an_existing_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    size = write_capsule([OURS], path)
    assert path.stat().st_size == size < 200_000
    with pytest.raises(OutputExists):
        write_capsule([OURS], path)
    assert write_capsule([OURS], path, force=True) == size
    assert [p.name for p in tmp_path.iterdir()] == ["run.html"]


def test_the_folder_of_a_page_is_made(tmp_path: Path) -> None:
    assert write_capsule([OURS], tmp_path / "new" / "folder" / "run.html") > 0
    assert (tmp_path / "new" / "folder" / "run.html").exists()
