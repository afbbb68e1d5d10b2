"""The timeline stays below the house, in windows of any size."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copy

import pytest
from chromium import chromium, open_view, until
from playwright.sync_api import Browser
from sample_logs import write_toy_log

from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

PLACES = """
  const box = (part) => part.getBoundingClientRect();
  const canvas = [...document.querySelectorAll("canvas")].find((c) => c.clientWidth > 300);
  const house = box(canvas), timeline = box(document.querySelector(".lios-timeline").closest(".mantine-Paper-root"));
  const panel = box(document.querySelector(".lp .facts"));
  const tabs = [...document.querySelectorAll('[role="tab"]')].filter((tab) => tab.title !== "Timeline");
"""
FITS = f"""(() => {{ {PLACES}
  return Math.abs(house.bottom - timeline.top) < 2 && Math.abs(timeline.bottom - innerHeight) < 2
    && house.left === timeline.left && house.right === timeline.right && house.right <= panel.left
    && house.bottom > innerHeight / 2 && new Set(tabs.map((tab) => Math.round(box(tab).top))).size === 1;
}})()"""
HOUSE_BOTTOM = f"(() => {{ {PLACES} return house.bottom; }})()"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def dashboard(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dashboard]:
    made = open_dashboard([write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap")], port=0)
    yield made
    made.stop()


def test_nothing_lies_over_the_house_at_any_size_also_after_resizing(browser: Browser, dashboard: Dashboard) -> None:
    page = open_view(browser, dashboard.link(), width=1000, height=700)
    for width, height in ((1000, 700), (1440, 900), (3840, 2160), (1000, 700)):
        page.set_viewport_size({"width": width, "height": height})
        until(page, FITS)
    page.close()


def test_words_typed_letter_by_letter_are_one_command(browser: Browser, dashboard: Dashboard) -> None:
    page = open_view(browser, dashboard.link(), width=1000, height=700)
    field = page.locator("label", has_text="Go to").locator("xpath=../../..").locator("input")
    field.click()
    page.keyboard.type("decision 2", delay=120)
    page.wait_for_function("parseFloat(new URLSearchParams(location.search).get('at')) > 0")
    field.click()
    page.keyboard.type("decision 99", delay=50)
    page.get_by_text("Not understood").wait_for()
    page.close()


def test_a_lower_timeline_leaves_its_place_to_the_house(browser: Browser, dashboard: Dashboard) -> None:
    page = open_view(browser, dashboard.link(), width=1000, height=700)
    until(page, FITS)
    before: float = page.evaluate(HOUSE_BOTTOM)
    page.evaluate("document.querySelector('.lios-timeline .legend').style.display = 'none'")
    until(page, f"{HOUSE_BOTTOM} > {before + 5}")
    page.close()


ONE_ROW = """(() => {
  const tabs = [...document.querySelectorAll('[role="tab"]')].filter((tab) => tab.title !== "Timeline");
  return tabs.length === 10 && new Set(tabs.map((tab) => Math.round(tab.getBoundingClientRect().top))).size === 1
    && tabs.every((tab) => tab.getBoundingClientRect().right <= innerWidth);
})()"""
NO_WIDER = """(() => { const table = document.querySelector("table[data-table=runs]");
  return table.getBoundingClientRect().right <= innerWidth
    && table.closest(".lp").scrollWidth <= table.closest(".lp").clientWidth; })()"""


def test_ten_tabs_are_one_row_and_the_table_of_runs_fits_a_narrow_window(browser: Browser, tmp_path: Path) -> None:
    first = write_toy_log(tmp_path / "a-run-with-quite-a-long-name-of-its-own.mcap")
    copy(first, tmp_path / "another-of-the-same.mcap")
    dashboard = open_dashboard([tmp_path], port=0, memory=True)
    page = open_view(browser, dashboard.link(), width=1440, height=900)
    heads = page.locator("table[data-table=runs] th").all_inner_texts()
    assert heads == ["", "strategy", "cost", "outcome", "looks", "scenario"]
    until(page, ONE_ROW)
    until(page, NO_WIDER)
    page.set_viewport_size({"width": 440, "height": 900})
    page.locator("table[data-table=runs]").wait_for()
    until(page, NO_WIDER)
    page.close()
    dashboard.stop()
