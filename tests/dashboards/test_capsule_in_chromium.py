"""The offline page, pictures and videos, in a real browser without a network."""

from __future__ import annotations

import base64
import itertools
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from chromium import chromium, colours_in, new_page, until, until_seen, until_still
from PIL import Image, ImageChops, ImageStat
from playwright.sync_api import Browser, Page
from toy_run import named_run, other_run, toy_run

from dashboards.capsule.write import write_capsule
from dashboards.model.clock import Clock
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.rendering.mp4 import Sample, mp4
from dashboards.rendering.picture import Framing, draw_picture

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    path = tmp_path_factory.mktemp("capsule") / "run.html"
    write_capsule([timeline_of(toy_run()), timeline_of(other_run())], path)
    opened = new_page(browser, width=1200, height=760)
    opened.context.set_offline(True)
    opened.goto(path.as_uri())
    until(opened, "window.lios !== undefined")
    yield opened
    opened.close()


def shown(page: Page) -> float:
    return float(page.evaluate("window.lios.state.at"))


def test_the_house_is_drawn(page: Page) -> None:
    until_seen(page, lambda picture: colours_in(picture, (0.05, 0.1, 0.6, 0.7)) > 200)
    page.get_by_text("find mug and bring it to start").wait_for()


def test_keys_step_and_seek_both_ways(page: Page) -> None:
    page.keyboard.press("Home")
    page.keyboard.press("l")
    assert shown(page) == 4.0
    page.get_by_text("Decision 2 of 3").wait_for()
    page.keyboard.press("Shift+L")
    assert shown(page) == 5.0
    page.keyboard.press("j")
    assert shown(page) == 4.0
    page.keyboard.press("End")
    assert shown(page) == 15.0
    page.get_by_text("done", exact=True).first.wait_for()
    page.keyboard.press("Home")
    page.get_by_text("Decision 1 of 3").wait_for()


def test_costs_run_between_frames(page: Page) -> None:
    page.evaluate("window.lios.seek(1)")
    assert page.locator("#p-now [data-live=cost]").inner_text() == "0.5"
    assert page.locator("#p-now [data-live=walked]").inner_text() == "0.5 m"


@pytest.mark.parametrize("second", [0.0, 1.0, 5.5, 8.0, 99.0])
def test_compare_tells_each_run_at_the_moment_shown(page: Page, second: float) -> None:
    page.get_by_role("tab", name="Compare", exact=True).click()
    page.evaluate(f"window.lios.seek({second})")
    clock = Clock(timelines=(timeline_of(toy_run()), timeline_of(other_run())))
    scenes = [scene_at(t, s) for t, s in zip(clock.timelines, clock.stamps(second), strict=True)]
    cells = page.locator("table[data-table=comparison] [data-live]").all_inner_texts()
    assert cells == [w for s in scenes for w in (f"{s.cost:.1f}", f"{s.travel_m:.1f}", str(s.searches))]


def test_an_item_that_was_seen_has_its_name_until_it_is_taken(page: Page) -> None:
    name = page.locator("#labels .item")
    page.evaluate("window.lios.seek(8)")
    assert name.all_inner_texts() == ["mug"]
    assert name.first.is_visible()
    page.evaluate("window.lios.seek(13)")
    assert not any(n.is_visible() for n in name.all())


def test_a_narrow_window_scrolls_down_only(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "narrow.html"
    write_capsule([timeline_of(toy_run()), timeline_of(other_run())], path)
    page = browser.new_page(viewport={"width": 440, "height": 900})
    page.goto(path.as_uri())
    until(page, "window.lios !== undefined")
    for tab in ("Belief", "Plan", "Find costs", "Plots", "Compare"):
        page.get_by_role("tab", name=tab, exact=True).click()
        assert page.evaluate(
            "[...document.querySelectorAll('html, .lp')].every((b) => b.scrollWidth <= b.clientWidth)"
        )
    page.close()


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(
    ("tab", "words"),
    [
        ("Plan", "Ways to begin"),
        ("Find costs", "model (exists) costs from"),
        ("Plots", "Cost so far"),
        ("Compare", "They diverge"),
    ],
)
def test_every_tab(page: Page, tab: str, words: str) -> None:
    page.evaluate("window.lios.seek(0)")
    page.get_by_role("tab", name=tab, exact=True).click()
    page.get_by_text(words).first.wait_for()


@pytest.mark.ci
def test_clocks_cameras_walls_and_play(page: Page) -> None:
    page.select_option("#clock", "distance")
    page.evaluate("window.lios.seek(1.5)")
    assert page.locator("#reading").inner_text() == "1.5 m"
    page.select_option("#clock", "time")
    for button in ("Above", "Follow", "Fit", "Walls"):
        page.get_by_role("button", name=button).click()
    page.evaluate("window.lios.seek(0)")
    page.select_option("#speed", "16")
    page.locator("#play").click()
    until(page, "!window.lios.state.playing && window.lios.state.at >= 14.99")


@pytest.mark.ci
def test_the_address_restores_the_moment(page: Page) -> None:
    page.evaluate("window.lios.seek(6.5)")
    until(page, "location.hash.includes('at=6.5')")
    page.reload()
    until(page, "window.lios !== undefined")
    assert shown(page) == 6.5


@pytest.mark.ci
def test_names_of_robots_that_stand_together_stay_in_the_picture(browser: Browser, tmp_path: Path) -> None:
    """On a small screen five of them at one place would be pushed out of its top. The time stays by its slider."""
    path = tmp_path / "five.html"
    write_capsule([timeline_of(toy_run()), *(timeline_of(other_run()) for _ in range(7))], path)
    page = new_page(browser, height=560)
    page.goto(path.as_uri())
    until(page, "window.lios !== undefined && document.querySelectorAll('#labels .robot').length === 8")
    boxes = until_still(
        page,
        "[...document.querySelectorAll('#labels .robot')].filter((d) => d.style.display !== 'none')"
        ".map((d) => d.getBoundingClientRect()).map((b) => [b.top, b.bottom])",
    )
    words, marks = page.evaluate(
        "['color', 'borderLeftColor'].map((k) => [...document.querySelectorAll('#labels .robot')]"
        ".map((d) => getComputedStyle(d)[k]))"
    )
    assert set(words) == {"rgb(35, 38, 43)"}, "names in the colours of runs would be too pale to read"
    assert len(set(marks)) == 8
    stage = page.locator("#stage").bounding_box()
    slider, reading = page.locator("#slider").bounding_box(), page.locator("#reading").bounding_box()
    page.close()
    assert stage
    assert slider
    assert reading
    assert len(boxes) == 8
    assert all(stage["y"] <= top and bottom <= stage["y"] + stage["height"] for top, bottom in boxes)
    tops = sorted(top for top, _ in boxes)
    assert all(b - a >= 17 for a, b in itertools.pairwise(tops)), "one covers another"
    assert abs(slider["y"] + slider["height"] / 2 - reading["y"] - reading["height"] / 2) < 8


def test_markup_in_names_is_shown_and_not_run(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "nasty.html"
    write_capsule([timeline_of(named_run('<img src=x onerror="window.ran=1"><b>bold</b>'))], path)
    tab = new_page(browser)
    failures: list[str] = []
    tab.on("pageerror", lambda error: failures.append(str(error)))
    tab.goto(path.as_uri())
    until(tab, "window.lios !== undefined")
    for key in ("l", "l", "End"):
        tab.keyboard.press(key)
    assert tab.evaluate("window.ran") is None
    assert "<b>bold</b>" in tab.locator("#p-title").inner_text()
    assert failures == []
    tab.close()


@pytest.mark.ci
def test_films_are_playable(browser: Browser, tmp_path: Path) -> None:
    """The page encodes, mp4() wraps, and a video element reads the length, the size and the frames."""
    page_path, film = tmp_path / "run.html", tmp_path / "run.mp4"
    write_capsule([timeline_of(toy_run())], page_path)
    tab = new_page(browser, width=320, height=240)
    tab.goto(page_path.as_uri())
    until(tab, "window.lios !== undefined")
    tab.evaluate("window.lios.bare({caption: false})")
    tab.evaluate("window.liosFilm.begin({width: 320, height: 240, fps: 10, caption: true})")
    chunks = tab.evaluate("window.liosFilm.draw([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11])")
    last = tab.evaluate("window.liosFilm.end()")
    samples = [Sample(_bytes(c["data"]), c["key"]) for c in [*chunks, *last["chunks"]]]
    film.write_bytes(mp4(samples, _bytes(last["description"]), width=320, height=240, frames_a_second=10))
    (tmp_path / "v.html").write_text('<video id="v" muted preload="auto" src="run.mp4"></video>')
    tab.goto((tmp_path / "v.html").as_uri())
    until(tab, "v.readyState >= 2")
    assert tab.evaluate("[v.videoWidth, v.videoHeight, Math.round(v.duration * 10)]") == [320, 240, 12]
    assert len(samples) == 12
    assert samples[0].key
    tab.close()


def test_render_writes_a_picture(tmp_path: Path) -> None:
    path = tmp_path / "frame.png"
    framing = Framing(width=640, height=400)
    with ThreadPoolExecutor(1) as apart:  # This thread drives a browser of its own already.
        apart.submit(draw_picture, [timeline_of(toy_run())], path, at_s=6.0, framing=framing).result()
    with Image.open(path) as image:
        assert image.size == (640, 400)
    assert colours_in(path.read_bytes(), (0.2, 0.1, 0.8, 0.6)) > 100


def _bytes(text: str) -> bytes:
    return base64.b64decode(text)


@pytest.mark.slow
def test_a_larger_picture_has_larger_words(tmp_path: Path) -> None:
    """The same picture in more pixels: for a slide or a print."""
    for name, width, height in (("small", 1280, 720), ("large", 1920, 1080), ("odd", 1301, 907)):
        framing = Framing(width=width, height=height)
        with ThreadPoolExecutor(1) as apart:
            path = tmp_path / f"{name}.png"
            apart.submit(draw_picture, [timeline_of(toy_run())], path, at_s=5.0, framing=framing).result()
    small, large, odd = (Image.open(tmp_path / f"{name}.png").convert("L") for name in ("small", "large", "odd"))
    assert (large.size, odd.size) == ((1920, 1080), (1301, 907))
    differences = ImageChops.difference(small, large.resize(small.size, Image.Resampling.BOX))
    assert ImageStat.Stat(differences).mean[0] < 2.0


@pytest.mark.ci
def test_sizes_keep_whole_points() -> None:
    sizes = {(1280, 720): 1.0, (1920, 1080): 1.5, (3840, 2160): 3.0, (1301, 907): 1.0, (640, 360): 1.0}
    assert {size: Framing(width=size[0], height=size[1]).scale for size in sizes} == sizes


@pytest.mark.ci
def test_no_caption_covers_the_house(browser: Browser, tmp_path: Path) -> None:
    """Of a picture the caption's own height is kept free; of a film, what its lines take."""
    path = tmp_path / "caption.html"
    write_capsule([timeline_of(toy_run())], path)
    tab = new_page(browser, width=800, height=450)
    tab.goto(path.as_uri())
    until(tab, "window.lios !== undefined")
    tab.evaluate("window.lios.bare({caption: true})")
    tab.evaluate("window.lios.seek(5)")
    tall = "document.getElementById('caption').getBoundingClientRect().height"
    until_still(tab, f"[{tall}, window.lios.fitting.covered]")
    caption = f"{tall} / document.getElementById('view').clientHeight"
    assert tab.evaluate("document.getElementById('view').clientHeight") == 450, "a narrow picture is all picture"
    assert tab.evaluate(caption) > 0.15
    assert tab.evaluate("window.lios.fitting.covered") > tab.evaluate(caption)
    tab.evaluate("window.lios.bare({caption: false, coveredPx: 90})")
    assert tab.evaluate("window.lios.fitting.covered") == pytest.approx(0.2, abs=0.01)
    tab.close()


@pytest.mark.ci
def test_behind_the_robot_the_caption_covers_little_and_the_robot_stands_above_it(
    browser: Browser, tmp_path: Path
) -> None:
    """The robot's label, a hand above it, is in the middle third of what the caption leaves."""
    path = tmp_path / "follow.html"
    write_capsule([timeline_of(toy_run())], path)
    tab = new_page(browser, width=700, height=500)
    tab.goto(path.as_uri())
    until(tab, "window.lios !== undefined")
    tab.evaluate("window.lios.bare({caption: true})")
    tab.evaluate("window.lios.follow(true)")
    tab.evaluate("window.lios.seek(5)")
    until_still(tab, "document.querySelector('#labels .robot').getBoundingClientRect().top")
    free = tab.evaluate("document.getElementById('caption').getBoundingClientRect().top")
    assert free > 500 * 0.6
    label = tab.evaluate("document.querySelector('#labels .robot').getBoundingClientRect().top")
    assert free / 3 - 60 < label < free / 2
    tab.close()
