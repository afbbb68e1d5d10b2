"""A container opened by a click in a table and in the view: its contents, its reasons, the truth on request."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import chromium, open_view
from playwright.sync_api import Browser, expect
from sample_logs import write_toy_log

from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def dashboard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dashboard]:
    made = open_dashboard([write_toy_log(tmp_path_factory.mktemp("container") / "run.mcap")], port=0)
    yield made
    made.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.mark.parametrize(("width", "height", "theme"), [(1440, 900, "light"), (1000, 700, "dark")])
def test_a_click_in_the_table_opens_the_container(
    browser: Browser, dashboard: Dashboard, tmp_path: Path, width: int, height: int, theme: str
) -> None:
    page = open_view(browser, dashboard.link(f"theme={theme}"), width=width, height=height)
    page.keyboard.press("End")
    page.get_by_role("tab", name="Belief", exact=True).click()
    page.locator("table[data-table=beliefs] [data-lios^=look]", has_text=re.compile("^dining table", re.I)).click()
    panel = page.locator(".lp.container:visible")
    expect(panel).to_contain_text("Searched at")
    expect(panel).not_to_contain_text("Ground truth")
    page.get_by_role("checkbox", name="Ground truth").check()
    expect(panel).to_contain_text("Ground truth at the start")
    expect(page.locator("table[data-table=considered]:visible")).to_contain_text("chosen")
    page.wait_for_function("location.search.includes('container=DiningTable')")
    page.wait_for_timeout(1500)
    page.screenshot(path=tmp_path / "container.png")
    page.reload()
    page.get_by_role("tab", name="Container", exact=True).click()
    expect(page.locator(".lp.container:visible")).to_contain_text("Ground truth at the start")
    page.close()


def test_a_click_in_the_view_opens_the_container(browser: Browser, dashboard: Dashboard) -> None:
    page = open_view(browser, dashboard.link(), width=1440, height=900)
    page.keyboard.press("t")
    page.wait_for_timeout(2500)
    box = page.locator("canvas").first.bounding_box()
    assert box
    panel = page.locator(".lp.container:visible")
    for share_x, share_y in ((x / 20, y / 20) for y in range(2, 14) for x in range(1, 14)):
        page.mouse.click(box["x"] + share_x * box["width"], box["y"] + share_y * box["height"])
        page.wait_for_timeout(60)
        if panel.count():
            break
    expect(panel).to_contain_text("What was there")
    page.close()
