"""Light and dark: the contrast of all text in panels, by the system's preference and by choice."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from chromium import chromium, until
from playwright.sync_api import Browser, Error, Page, expect
from toy_run import other_run, toy_run

from dashboards.capsule.write import write_capsule
from dashboards.model.timeline import timeline_of
from dashboards.resources import resource
from dashboards.viser_app.serving import open_dashboard

LOGS = [Path(__file__).resolve().parents[2] / "logs" / f"find-{name}.mcap" for name in ("lios", "greedy")]
MIN_CONTRAST = 4.5
"""The least contrast of text, WCAG 2.1, 1.4.3."""
TEXTS = ("ink", "soft", "muted", "link")
SURFACES = ("page", "raised", "chosen", "warned")
FAINT = """(() => {
  const parts = (css) => (css.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number);
  const light = (rgb) => rgb.slice(0, 3).map((v) => v / 255)
    .map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const below = (node) => {
    for (let at = node; at; at = at.parentElement) {
      const colour = parts(getComputedStyle(at).backgroundColor);
      if (colour.length === 3 || colour[3] > 0.9) return colour;
    }
    return [255, 255, 255];
  };
  const found = [];
  for (const node of document.querySelectorAll(".lp *, #controls *, #tabs *")) {
    const words = [...node.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent.trim()).join("");
    if (!words || !node.getClientRects().length || node.closest("title")) continue;
    const style = getComputedStyle(node), svg = node.namespaceURI.endsWith("svg");
    const two = [light(parts(svg ? style.fill : style.color)), light(below(node))].sort();
    const ratio = (two[1] + 0.05) / (two[0] + 0.05);
    if (ratio < 4.5) found.push(`${words}: ${ratio.toFixed(2)}`);
  }
  return found;
})()"""


def _tokens(mode: str) -> dict[str, str]:
    start = ":root {" if mode == "light" else ':root[data-theme="dark"], :root[data-mantine-color-scheme="dark"] {'
    block = resource("panels/panels.css").split(start)[1].split("}")[0]
    return dict(re.findall(r"--([\w-]+): (#[0-9a-fA-F]{6})", block))


def _contrast(one: str, other: str) -> float:
    def light(colour: str) -> float:
        parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
        return sum(v * w for v, w in zip(linear, (0.2126, 0.7152, 0.0722), strict=True))

    low, high = sorted((light(one), light(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_by_hand() -> None:
    assert _contrast("#000000", "#ffffff") == pytest.approx(21)
    assert _contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("mode", ["light", "dark"])
def test_text_can_be_read_on_every_surface(mode: str) -> None:
    tokens = _tokens(mode)
    pairs = [(text, surface) for text in TEXTS for surface in SURFACES] + [("wrong-ink", "wrong")]
    weak = {pair: c for pair in pairs if (c := _contrast(tokens[pair[0]], tokens[pair[1]])) < MIN_CONTRAST}
    assert weak == {}


def test_panels_name_no_colour_of_their_own() -> None:
    """Else it would be the same in light and in dark."""
    rules = resource("panels/panels.css").split("}", 2)[2]
    assert re.findall(r"#[0-9a-fA-F]{3,6}\b", rules) == []


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def capsule(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("capsule") / "run.html"
    write_capsule([timeline_of(toy_run()), timeline_of(other_run())], path)
    return path.as_uri()


def _mode(page: Page) -> str:
    return page.evaluate("document.documentElement.dataset.theme")


@pytest.mark.browser
@pytest.mark.parametrize("mode", ["light", "dark"])
def test_the_offline_page_is_as_the_system_prefers_and_can_be_read(browser: Browser, capsule: str, mode: str) -> None:
    page = browser.new_page(
        viewport={"width": 1000, "height": 700}, color_scheme="dark" if mode == "dark" else "light"
    )
    page.goto(capsule + "#at=5")
    until(page, "window.lios !== undefined")
    assert _mode(page) == mode
    for tab in ("Belief", "Plan", "Find costs", "Plots", "Compare"):
        page.get_by_role("tab", name=tab, exact=True).click()
        assert page.evaluate(FAINT) == []
    page.close()


@pytest.mark.browser
def test_a_choice_goes_before_the_systems_preference_and_stays(browser: Browser, capsule: str) -> None:
    page = browser.new_page(color_scheme="light")
    page.goto(capsule)
    until(page, "window.lios !== undefined")
    page.locator("#theme").click()
    assert _mode(page) == "dark"
    until(page, "location.hash.includes('theme=dark')")
    page.reload()
    until(page, "window.lios !== undefined")
    assert _mode(page) == "dark"
    page.keyboard.press("d")
    assert _mode(page) == "light"
    page.evaluate("window.lios.bare({})")
    page.emulate_media(color_scheme="dark")
    assert _mode(page) == "light", "pictures are the same on every system"
    page.close()


@pytest.mark.ci
@pytest.mark.browser
def test_the_offline_page_has_a_scale_and_lists_its_keys(browser: Browser, capsule: str) -> None:
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.goto(capsule)
    until(page, "window.lios !== undefined")
    page.evaluate("window.lios.camera({distance: 10})")
    near = page.evaluate("[parseFloat(document.getElementById('scale').style.width), scale.textContent]")
    assert near[1] == "1 m"
    high = page.evaluate("document.getElementById('view').clientHeight")
    assert near[0] == pytest.approx(high / (2 * 10 * 0.34252), abs=0.5), "the tangent of half of 0.66 rad"
    page.evaluate("window.lios.camera({distance: 40})")
    assert page.locator("#scale").inner_text() == "5 m"
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys")).to_contain_text("previous, next decision")
    expect(page.get_by_role("dialog", name="Keys")).to_contain_text("follow the robot")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog", name="Keys")).to_have_count(0)
    page.close()


def _until(page: Page, expression: str, wanted: object) -> None:
    """Waits for a value, also while the page is replaced by another."""
    end, found = time.monotonic() + 180, None
    while found != wanted:
        assert time.monotonic() < end, f"{expression[:80]}: {found}, not {wanted}"
        with suppress(Error):
            found = page.evaluate(expression)
        page.wait_for_timeout(100)


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.timeout(900)
@pytest.mark.filterwarnings("ignore:Queued .* on a closed connection")
def test_the_dashboard_follows_the_system_and_its_own_switch(browser: Browser) -> None:
    dashboard = open_dashboard(LOGS, port=0)
    context = browser.new_context(color_scheme="dark", viewport={"width": 1000, "height": 700})
    page = context.new_page()
    page.set_default_timeout(90_000)
    page.goto(dashboard.link("at=14"))
    page.locator(".lp .facts").wait_for()
    mode = "document.documentElement.dataset.mantineColorScheme"
    _until(page, mode, "dark")
    for tab in ("Plan", "Find costs", "Plots", "Compare", "Belief"):
        page.get_by_role("tab", name=tab, exact=True).click()
        _until(page, f"String({FAINT})", "")
    _until(page, "/^\\d+ m$/.test(document.querySelector('.lios-scale')?.textContent)", True)
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys")).to_contain_text("fit the house")
    page.keyboard.press("Escape")
    page.emulate_media(color_scheme="light")
    _until(page, mode, "light")
    page.goto(dashboard.link("theme=dark"))
    _until(page, mode, "dark")
    _until(page, "location.search.includes('theme=dark')", True)
    context.close()
    dashboard.stop()
