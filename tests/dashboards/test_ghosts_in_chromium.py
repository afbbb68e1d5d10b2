"""Ghosts beside a run that is being recorded, in Chromium: the sentence, the bounds, the names in the legend."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import chromium, open_view
from playwright.sync_api import Browser, expect

from dashboards.viser_app.serving import open_dashboard

LOG = Path(__file__).resolve().parents[2] / "logs" / "spot-home-C-pes-lios.mcap"

pytestmark = [
    pytest.mark.browser,
    pytest.mark.timeout(600),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.mark.ci
@pytest.mark.parametrize(("width", "height", "theme"), [(1440, 900, "light"), (1000, 700, "dark")])
def test_the_cockpit_says_what_is_proven_beside_the_figures_of_each(
    browser: Browser, width: int, height: int, theme: str
) -> None:
    dashboard = open_dashboard([LOG], port=0, follow=True, ghosts="pes-greedy")
    page = open_view(browser, dashboard.link(f"theme={theme}"), width=width, height=height)
    page.wait_for_function(f"document.documentElement.dataset.mantineColorScheme === '{theme}'")
    verdict = page.locator(".lp.ghosts [data-live=verdict]")
    expect(verdict).to_contain_text(
        "pes-lios is provably beaten: pes-greedy costs at least 10.9 less", timeout=120_000
    )
    expect(verdict).to_be_in_viewport()
    rows = page.locator("table[data-table=ghosts] tbody tr")
    expect(rows).to_have_count(2)
    charged = page.locator(".lp .facts b[data-live=cost]").inner_text()
    expect(rows.nth(0)).to_contain_text(f"{charged}", timeout=90_000)
    expect(rows.nth(0)).to_contain_text("(driven)")
    expect(rows.nth(1)).to_contain_text("53.5")
    expect(page.locator(".lios-timeline .legend").first).to_contain_text("pes-greedy", timeout=90_000)
    expect(page.get_by_text("paler robot: another run")).to_be_visible()
    page.close()
    dashboard.stop()
