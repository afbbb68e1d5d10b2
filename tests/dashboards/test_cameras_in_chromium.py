"""Where the camera stands in a real browser: fitted to the window, until somebody moves it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chromium import chromium, open_view
from playwright.sync_api import Browser
from sample_logs import write_toy_log

from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(1200),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture
def view(tmp_path: Path) -> Iterator[tuple[Browser, Dashboard]]:
    dashboard = open_dashboard([write_toy_log(tmp_path / "toy.mcap")], port=0)
    with chromium() as browser:
        yield browser, dashboard
    dashboard.stop()


def test_the_house_is_fitted_to_a_window_of_another_shape_until_somebody_moves_the_camera(
    view: tuple[Browser, Dashboard],
) -> None:
    browser, dashboard = view
    before = set(dashboard.sessions)
    tab = open_view(browser, dashboard.link(), width=1300, height=800)
    (session,) = [s for i, s in dashboard.sessions.items() if i not in before]
    camera = session.client.camera

    def is_fitted() -> bool:
        pose = session.camera.pose()
        return pose is not None and np.allclose(camera.position, pose.position, atol=0.05)

    def wait(wide: int) -> None:
        end = time.monotonic() + 30
        while (camera.image_width != wide or not is_fitted()) and time.monotonic() < end:
            tab.wait_for_timeout(100)

    wait(1300 - 444)
    assert is_fitted()
    narrow = tuple(camera.position)
    tab.set_viewport_size({"width": 1100, "height": 800})
    wait(1100 - 444)
    assert is_fitted()
    assert tuple(camera.position) != narrow
    fitted = tuple(camera.position)
    session.open_container(0)
    end = time.monotonic() + 30
    while np.allclose(camera.position, fitted, atol=0.05) and time.monotonic() < end:
        tab.wait_for_timeout(100)
    moved = tuple(camera.position)
    tab.set_viewport_size({"width": 1300, "height": 800})
    tab.wait_for_timeout(1500)
    assert np.allclose(camera.position, moved, atol=0.05), "what somebody looks at stays"
    tab.close()
