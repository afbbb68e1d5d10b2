"""Field of view, viewpoints and what is left after a miss in a real browser: dashboard and offline page."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium import chromium, new_page, open_view, until, until_seen, wait_for_second
from PIL import Image
from playwright.sync_api import Browser, Page
from test_fruitless_looks import missing
from test_sight import passing
from toy import COUNTER
from toy_run import ns

from dashboards.capsule.write import write_capsule
from dashboards.model.perception.sight import sight_outline
from dashboards.model.scene import scene_at
from dashboards.viser_app.serving import open_dashboard
from recorders.record_run import record

pytestmark = [
    pytest.mark.browser,
    pytest.mark.timeout(600),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]

HOUSE = (0.27, 0.1, 0.6, 0.75)
"""A part of the dashboard in which the house is drawn, beside any notification: left, top, right, bottom."""
DRAWN_PX = 500
"""Pixels that a field of view and its viewpoints change, at least."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def _house(picture: bytes) -> np.ndarray:
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    w, h = image.size
    box = (int(HOUSE[0] * w), int(HOUSE[1] * h), int(HOUSE[2] * w), int(HOUSE[3] * h))
    return np.asarray(image.crop(box)).astype(np.int64)


def _changed(one: bytes, other: bytes) -> int:
    """How many pixels of the house differ clearly."""
    return int((np.abs(_house(one) - _house(other)).sum(axis=2) > 30).sum())


def _still(page: Page) -> bytes:
    """A picture that several in a row agree with."""
    last: list[bytes] = []

    def same(picture: bytes) -> bool:
        last.append(picture)
        return len(last) > 4 and all(_changed(picture, before) < DRAWN_PX // 10 for before in last[-5:-1])

    return until_seen(page, same)


@pytest.mark.ci
def test_the_dashboard_draws_the_sight_and_its_layer_can_be_hidden(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    record(path, house="houses:3", find="book", estimator="counts", sees=2.5)
    dashboard = open_dashboard([path], port=0)
    try:
        page = open_view(browser, dashboard.link(), width=1200, height=760)
        page.get_by_text("sees so far").wait_for()
        page.get_by_text("seen in passing").first.wait_for()
        (session,) = dashboard.sessions.values()
        session.change(at=session.clock.end, sight=False)
        wait_for_second(page, 1.0, 9e9)
        hidden = _still(page)
        session.change(sight=True)
        until_seen(page, lambda picture: _changed(picture, hidden) > DRAWN_PX)
        shown = _still(page)
        session.change(sight=False)
        until_seen(page, lambda picture: _changed(picture, shown) > DRAWN_PX)
        page.close()
    finally:
        dashboard.stop()


@pytest.mark.ci
def test_the_offline_page_draws_the_field_of_view_as_the_log_has_it(browser: Browser, tmp_path: Path) -> None:
    timeline = passing()
    write_capsule([timeline], tmp_path / "run.html")
    page = new_page(browser, width=1200, height=760)
    page.goto((tmp_path / "run.html").as_uri())
    until(page, "window.lios !== undefined")
    for second, seen in ((1.0, 1), (4.5, 1), (8.0, 2)):
        page.evaluate(f"window.lios.seek({second})")
        shown = page.evaluate("window.lios.state.sight")
        robot = scene_at(timeline, ns(second)).robot
        assert np.array(shown["ends"]) == pytest.approx(sight_outline(timeline, (robot.x_m, robot.y_m)), abs=0.06)
        assert shown["seen"] == seen
    page.get_by_text("sees so far").wait_for()
    page.close()


def test_the_offline_page_says_what_a_missed_look_leaves(browser: Browser, tmp_path: Path) -> None:
    write_capsule([missing((7, COUNTER, ()))], tmp_path / "run.html")
    page = new_page(browser, width=1200, height=760)
    page.goto((tmp_path / "run.html").as_uri())
    until(page, "window.lios !== undefined")
    page.evaluate("window.lios.seek(8)")
    page.locator("#labels").get_by_text("7.9 % left").wait_for()
    page.get_by_text("perhaps missed, what is left").wait_for()
    page.evaluate("window.lios.seek(1)")
    page.locator("#labels").get_by_text("7.9 % left").wait_for(state="hidden")
    page.close()
