"""The panel while a run plays: tables wait, the moment does not, and a still moment has its own tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium import chromium, open_view
from markupsafe import Markup
from playwright.sync_api import Browser
from sample_logs import write_toy_log

from dashboards.model.scene import Scene
from dashboards.viser_app.panel import controls
from dashboards.viser_app.serving import open_dashboard

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def test_tables_are_drawn_again_once_a_run_stands_still(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moments: list[int] = []
    drawn: list[int] = []
    now, comparison = controls.now, controls.comparison

    def told(scene: Scene) -> Markup:
        moments.append(scene.stamp_ns)
        return now(scene)

    def compared(clock: Any, scenes: list[Scene], names: list[str], **more: Any) -> Markup:
        drawn.append(scenes[0].stamp_ns)
        return comparison(clock, scenes, names, **more)

    monkeypatch.setattr(controls, "now", told)
    monkeypatch.setattr(controls, "comparison", compared)
    monkeypatch.setattr(controls, "TABLES_EVERY_S", 3600.0)
    dashboard = open_dashboard([write_toy_log(tmp_path / "run.mcap")], port=0)
    page = open_view(browser, dashboard.link())
    page.get_by_role("button", name="Play").click()
    page.get_by_role("button", name="Pause").wait_for()
    page.get_by_role("button", name="Play").wait_for()  # it has come to its end, 15 s on
    page.wait_for_timeout(500)
    assert len(set(moments)) > len(set(drawn)) + 2
    assert drawn[-1] == moments[-1] == max(moments)
    page.close()
    dashboard.stop()
