"""Many runs in a browser: a folder of a thousand logs, twenty runs of one task at once, what is left out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copy

import pytest
from chromium import chromium, open_view, until
from playwright.sync_api import Browser, expect
from sample_logs import write_toy_log

from dashboards.viser_app.serving import open_dashboard

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def _copies(folder: Path, count: int) -> list[Path]:
    first = write_toy_log(folder / "run-0000.mcap")
    return [first, *(Path(copy(first, folder / f"run-{i:04}.mcap")) for i in range(1, count))]


def test_a_thousand_logs_are_ordered_grouped_filtered_and_opened(browser: Browser, tmp_path: Path) -> None:
    _copies(tmp_path, 1000)
    (tmp_path / "broken.mcap").write_bytes(b"no log")
    dashboard = open_dashboard([tmp_path], port=0)
    page = open_view(browser, dashboard.link(), width=1000, height=700)
    table = page.locator("table[data-table=runs]")
    expect(page.get_by_text("1000 of 1000 runs").first).to_be_visible()
    expect(page.get_by_text("1 logs left out")).to_be_visible()
    expect(page.get_by_text("broken.mcap").first).to_be_visible()
    page.locator('.seek[data-lios="order file"]').click()
    page.locator('.seek[data-lios="order file"]', has_text="▲").click()
    expect(table.locator("tbody tr").first).to_contain_text("run-0999.mcap")
    page.locator('[data-lios="page 2"]').first.click()
    expect(table.locator("tbody tr").first).to_contain_text("run-0799.mcap")
    field = page.locator("label", has_text="Filter").locator("xpath=../../..").locator("input")
    field.fill("run-0123")
    expect(page.get_by_text("1 of 1000 runs").first).to_be_visible()
    table.locator("[data-lios^=open]").first.click()
    page.wait_for_function("location.search.includes('runs=')")
    until(page, "!location.search.includes('runs=0&')")
    page.close()
    dashboard.stop()


@pytest.mark.parametrize(("width", "height", "theme"), [(1440, 900, "light"), (1000, 700, "dark")])
def test_twenty_runs_of_one_task_are_all_there_with_numbers(
    browser: Browser, tmp_path: Path, width: int, height: int, theme: str
) -> None:
    dashboard = open_dashboard(_copies(tmp_path, 26), port=0)
    page = open_view(browser, dashboard.link(f"theme={theme}"), width=width, height=height)
    marks = page.locator(".lios-timeline .whose span")
    expect(marks).to_have_count(24)
    expect(marks.nth(23)).to_have_text("24")
    page.get_by_role("tab", name="Compare", exact=True).click()
    expect(page.locator("table[data-table=comparison] tbody tr")).to_have_count(24)
    expect(page.get_by_text("2 more of the opened logs not on show")).to_be_visible()
    page.close()
    dashboard.stop()
