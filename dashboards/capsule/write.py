"""One HTML file that plays runs offline, for readers who have nothing installed.

The page carries the house as batches, each run as arrays, and the panels as they were at every moment at which
they changed, each text once; gzip makes that small. It loads nothing and sends nothing (its security policy says so).

Its renderer is 200 lines of our own: a library for 3D, which would have to stand in every page, is several times as
large as the page of a run.
"""

from __future__ import annotations

import base64
import gzip
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from dashboards.capsule.run_data import TextTable, run_data, still_panels
from dashboards.capsule.sight_data import sight_data
from dashboards.geometry.goal_places import goal_frames
from dashboards.geometry.house import HouseShape, house_shape
from dashboards.geometry.marks import Mesh, cross, robot_body, robot_legs, tick, unopened_marker, unseen_marker
from dashboards.geometry.occupancy import occupancy_mesh
from dashboards.geometry.sight_marks import DOT_M, eye
from dashboards.geometry.solids import SHAPES, Batch, unit_mesh
from dashboards.library.same_place import other_houses, same_house
from dashboards.model.clock import ALIGNMENTS, Clock
from dashboards.model.containers.unopened import unopened
from dashboards.model.labels import label
from dashboards.model.run_names import run_names
from dashboards.model.timeline import Timeline
from dashboards.palette import GOAL, IN_SIGHT, ITEM, OCCUPIED, SIGHT, UNOPENED, UNSEEN, run_colour
from dashboards.panels.comparison import mismatches
from dashboards.panels.markup import html, text
from dashboards.panels.now import run_signs, title
from dashboards.panels.phase_strip import strip
from dashboards.resources import resource
from dashboards.tabs import TABS
from workbench.errors import BadValue, OutputExists, first_few
from workbench.files import write_atomically
from workbench.worlds.names import readable_name

MAX_NAMED, LABEL_SPOTS = 6, 12
LABELLED = 5
"""How many containers of the intended order of search are numbered in the view."""
PARTS = (
    "panels/panels.js",
    "panels/help.js",
    *(
        f"capsule/page/{name}.js"
        for name in ("renderer", "clock", "ribbon", "sight", "labels", "painting", "theme", "player", "film")
    ),
)
SHEETS = ("panels/panels.css", "capsule/page/page.css")


def write_capsule(timelines: Sequence[Timeline], path: Path, *, force: bool = False) -> int:
    """Writes the page atomically; returns its size in bytes.

    Raises:
        OutputExists: the file is there and force is not given.
        BadValue: no runs.
    """
    if path.exists() and not force:
        raise OutputExists(path)
    page = capsule_page(timelines).encode("utf-8")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, page)
    return len(page)


def capsule_page(timelines: Sequence[Timeline]) -> str:
    """The page as text; the same runs give the same text. Runs of another place than the first's are left out.

    Raises:
        BadValue: no runs.
    """
    if not timelines:
        raise BadValue("runs of a capsule", (), "at least one")
    elsewhere = other_houses(timelines)
    data = msgspec.json.encode(_data(same_house(timelines), elsewhere), enc_hook=str)
    packed = base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")
    parts = {
        "@TITLE@": text(timelines[0].task_words),
        "@STYLE@": "".join(resource(name) for name in SHEETS),
        "@SCRIPT@": "\n".join(resource(name) for name in PARTS),
        "@DATA@": packed,
    }
    # In one pass, because a title may itself contain @DATA@.
    return re.sub("|".join(parts), lambda found: parts[found[0]], resource("capsule/page/page.html"))


def _left_out_note(elsewhere: Sequence[Timeline]) -> str:
    if not elsewhere:
        return ""
    named = first_few([f"{t.run.info.strategy} in {t.run.info.place}" for t in elsewhere], MAX_NAMED)
    return html('<div class="lp"><div class="warn">Left out, being of another place: {}.</div></div>', named)


def _data(timelines: tuple[Timeline, ...], elsewhere: Sequence[Timeline]) -> dict[str, Any]:
    first = timelines[0]
    names = run_names([t.run for t in timelines])
    clock = Clock(timelines=timelines)
    texts = TextTable()
    closed, signs = unopened(timelines), run_signs(timelines)
    runs = [
        run_data(t, label(names[i]), run_colour(i), texts, signs=signs if i == 0 else None)
        for i, t in enumerate(timelines)
    ]
    runs[0] |= sight_data(first, house_shape(first.plan).tops_m)
    return {
        "title": title(first) + mismatches(clock) + _left_out_note(elsewhere),
        "plainTitle": first.task_words,
        "tabs": TABS if len(timelines) > 1 else TABS[:-1],
        "labelled": LABELLED,
        "house": _house(first),
        "unopened": np.flatnonzero(closed).tolist(),
        "meshes": _meshes(),
        "colours": {
            "goal": GOAL,
            "item": ITEM,
            "unopened": UNOPENED,
            "unseen": UNSEEN,
            "sight": SIGHT,
            "inSight": IN_SIGHT,
            "dot": DOT_M,
        },
        "runs": runs,
        "still": still_panels(clock, names),
        "strips": {
            alignment: strip(
                Clock(timelines=timelines, alignment=alignment), names, [run_colour(i) for i in range(len(names))]
            )
            for alignment in ALIGNMENTS
        },
        "texts": texts.all,
    }


def _house(timeline: Timeline) -> dict[str, Any]:
    plan = timeline.plan
    shape = house_shape(plan)
    return {
        "floors": [
            {"vertices": _rounded(f.vertices), "faces": f.faces.ravel().tolist(), "colour": list(f.colour)}
            for f in shape.floors
        ]
        + _occupied(timeline),
        "rooms": [
            {
                "name": label(readable_name(f.kind)),
                "spots": np.round(np.array(f.label_spots[:LABEL_SPOTS]), 2).tolist(),
            }
            for f in shape.floors
        ],
        "goals": [
            _mesh(frame) | {"colour": list(GOAL)} for frame in goal_frames(timeline.run.place, timeline.run.task)
        ],
        "furniture": [_batch(b) for b in shape.furniture],
        "cut": [_batch(b) for b in shape.cut_walls],
        "whole": [_batch(b) for b in (*shape.whole_walls, *shape.hung)],
        "shadows": [_batch(b) for b in shape.shadows],
        "tops": [_rounded(np.array(t)) for t in shape.tops_m],
        "names": [label(readable_name(c.type)) for c in plan.containers],
        "corners": _outline(shape),
    }


def _occupied(timeline: Timeline) -> list[dict[str, Any]]:
    """The occupied cells of a place that was surveyed without walls, as one more floor."""
    place = timeline.run.place
    mesh = occupancy_mesh(place.occupancy) if not place.plan.walls and place.occupancy is not None else None
    if mesh is None:
        return []
    return [{"vertices": _rounded(mesh[0]), "faces": mesh[1].ravel().tolist(), "colour": list(OCCUPIED)}]


def _outline(shape: HouseShape) -> list[list[float]]:
    points = sorted({(round(float(x), 3), round(float(y), 3)) for f in shape.floors for x, y, _ in f.vertices})
    return [list(p) for p in points] or [list(shape.low), list(shape.high)]


def _batch(batch: Batch) -> dict[str, Any]:
    return {
        "shape": batch.shape,
        "centre": _rounded(batch.centre),
        "size": _rounded(batch.size_m),
        "yaw": _rounded(batch.yaw_rad, 4),
        "colour": batch.colour.ravel().tolist(),
        "owner": batch.owner.tolist(),
    }


def _meshes() -> dict[str, Any]:
    made: dict[str, Mesh] = {shape: unit_mesh(shape) for shape in SHAPES}
    made |= {
        "cross": cross(),
        "tick": tick(),
        "eye": eye(),
        "question": unseen_marker(),
        "unknown": unopened_marker(),
        "robotBody": robot_body(),
        "robotLegs": robot_legs(),
    }
    return {name: _mesh(mesh) for name, mesh in made.items()}


def _mesh(mesh: Mesh) -> dict[str, Any]:
    return {"vertices": _rounded(mesh[0]), "faces": mesh[1].ravel().tolist()}


def _rounded(values: np.ndarray, digits: int = 3) -> list[float]:
    return np.round(np.asarray(values, dtype=np.float64), digits).ravel().tolist()
