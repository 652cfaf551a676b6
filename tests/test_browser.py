"""The HTML report in a real browser, without network. Needs the extra ``browser`` and an installed Chromium."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.pages import drawn, records, whole_page

api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (extra: browser)")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed (extra: browser)")

SCREENS = {"desktop": (1280, 900, "light"), "dark": (1280, 900, "dark"), "phone": (390, 844, "light")}


# axe takes minutes over thousands of alike elements: paths inside pictures, and rows and steps like those above them
_THINNED = """() => {
  document.querySelectorAll('svg.plot').forEach(plot => plot.replaceChildren());
  document.querySelectorAll('.equations tr.proved:nth-child(n+4), .figures tr:nth-child(n+4), .steps > :nth-child(n+7)')
    .forEach(row => row.remove());
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("no Chromium is installed (on Debian: apt install chromium)")
    with api.sync_playwright() as started:
        opened = started.chromium.launch(
            executable_path=found,
            args=["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
        )
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(whole_page(**drawn(path.parent)), encoding="utf-8")
    return path


@pytest.fixture(scope="module", params=SCREENS)
def opened(browser: Any, file: Path, request: pytest.FixtureRequest) -> Iterator[tuple[str, Any, list[str]]]:
    """A screen's name, the page on it, and what the page should not have done."""
    width, height, scheme = SCREENS[request.param]
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=scheme, offline=True, java_script_enabled=True
    )
    faults: list[str] = []
    page = context.new_page()
    page.on("console", lambda message: faults.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    page.on("request", lambda sent: faults.extend([] if local(sent.url) else [f"request: {sent.url}"]))
    page.goto(file.as_uri())
    page.wait_for_load_state("networkidle")
    page.evaluate("document.querySelectorAll('details.derivation').forEach(each => each.open = true)")
    yield request.param, page, faults
    context.close()


def local(url: str) -> bool:
    return url.startswith(("file:", "data:", "about:"))


def test_no_errors_and_no_requests(opened: tuple[str, Any, list[str]]) -> None:
    assert opened[2] == []


def test_it_fits_the_screen(opened: tuple[str, Any, list[str]]) -> None:
    page = opened[1]
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
    outside = page.evaluate(
        """() => [...document.querySelectorAll('math')].filter(m => !m.closest('.wide') &&
             m.getBoundingClientRect().right > innerWidth).length"""
    )
    assert outside == 0


@pytest.mark.parametrize("place", [".derivation .formula", ".equations .formula", ".mistake .formula", ".mistake .was"])
def test_a_formula_that_is_too_long_scrolls_by_itself(opened: tuple[str, Any, list[str]], place: str) -> None:
    page = opened[1]
    found = page.evaluate(
        """place => { const seen = [...document.querySelectorAll(place)].find(
               each => each.getClientRects().length && each instanceof HTMLElement);
             const long = seen.appendChild(document.createElement('span'));
             long.style.cssText = 'display: inline-block; width: 3000px';
             const right = long.getBoundingClientRect().right, whole = document.documentElement.scrollWidth;
             long.remove(); return [right > innerWidth, whole <= innerWidth] }""",
        place,
    )
    assert found == [True, True]


def test_what_a_table_shows_can_be_read_without_scrolling_it(opened: tuple[str, Any, list[str]]) -> None:
    cut = opened[1].evaluate(
        """() => [...document.querySelectorAll('caption span')].filter(each =>
             each.getBoundingClientRect().right > innerWidth).map(each => each.textContent)"""
    )
    assert cut == []


def test_two_clicks_from_anywhere_to_an_equation(opened: tuple[str, Any, list[str]]) -> None:
    page = opened[1]
    page.evaluate("document.documentElement.style.scrollBehavior = 'auto'; scrollTo(0, document.body.scrollHeight / 2)")
    page.locator(".contents a", has_text="Verdicts").click()
    page.locator(".glance a[href='#equation-18']").click()
    covered, top = page.evaluate(
        """() => [document.querySelector('.contents').getBoundingClientRect().bottom,
                  document.getElementById('equation-18').getBoundingClientRect().top]"""
    )
    assert 0 < covered <= top < page.viewport_size["height"] / 2


def test_accessible(opened: tuple[str, Any, list[str]]) -> None:
    """Contrast, names, alternative texts, headings, landmarks, tables, sizes of targets, by axe."""
    name, page, _ = opened
    page.evaluate(_THINNED)
    only = {} if name == "desktop" else {"runOnly": ["color-contrast", "target-size", "scrollable-region-focusable"]}
    found = axe.Axe().run(page, options={"resultTypes": ["violations"], **only})
    page.reload()
    faults = [(rule["id"], rule["nodes"][0]["html"][:200]) for rule in found.response["violations"]]
    assert faults == []
    assert "color-contrast" in {rule["id"] for rule in found.response["passes"]}


def test_every_link_leads_to_something_that_is_seen(opened: tuple[str, Any, list[str]]) -> None:
    lost = opened[1].evaluate(
        """() => [...document.querySelectorAll('a[href]')].map(a => a.getAttribute('href')).filter(href =>
             !href.startsWith('#') || !document.getElementById(href.slice(1))?.getClientRects().length)"""
    )
    assert lost == []


def test_formulas_are_set_in_the_font_that_comes_along(opened: tuple[str, Any, list[str]]) -> None:
    assert opened[1].evaluate('document.fonts.check(`16px "Report Math"`)')
    high = opened[1].evaluate("document.querySelector('#equation-2 mfrac').getBoundingClientRect().height")
    line = opened[1].evaluate("document.querySelector('#equation-1 msub').getBoundingClientRect().height")
    assert high > 1.5 * line  # a fraction is set as one


def test_a_scene_can_be_turned(opened: tuple[str, Any, list[str]]) -> None:
    page = opened[1]
    page.locator("details:has(iframe) > summary").click()
    frame = page.locator("iframe.turned")
    frame.scroll_into_view_if_needed()
    inside = page.frame_locator("iframe.turned")
    inside.locator("#title", has_text="a small cloth").wait_for()
    if inside.locator("#failed").is_visible():
        pytest.skip("this Chromium has no WebGL 2")
    inside.locator("#legend", has_text="warp").wait_for()
    before = frame.screenshot()
    box = frame.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 30, steps=4)
    page.mouse.up()
    assert frame.screenshot() != before
    assert opened[2] == []
    page.reload()


def test_readable_without_scripts_and_on_paper(browser: Any, file: Path) -> None:
    context = browser.new_context(java_script_enabled=False, offline=True)
    page = context.new_page()
    page.goto(file.as_uri())
    assert "73 proved" in page.inner_text("main") + page.inner_text("header")
    assert page.locator("#equation-44 math").count() > 0
    paper = page.pdf(prefer_css_page_size=True)
    assert paper.startswith(b"%PDF")
    assert 8 <= paper.count(b"/Type /Page\n") + paper.count(b"/Type /Page ") <= 50  # derivations are seven of them
    context.close()


def test_nothing_is_cut_off_on_paper(browser: Any, tmp_path: Path) -> None:
    """Laid out as wide as the paper is within its margins, no table, picture or formula reaches beyond."""
    path = tmp_path / "report.html"
    path.write_text(whole_page(records()), encoding="utf-8")
    context = browser.new_context(offline=True)
    page = context.new_page()
    page.emulate_media(media="print")
    page.goto(path.as_uri())
    for paper in (210, 216):  # A4 and Letter, and the margins of the style
        page.set_viewport_size({"width": round((paper - 2 * 14) / 25.4 * 96), "height": 1000})
        assert cut_off(page) == []
    assert page.locator(".contents").is_hidden()
    context.close()


def cut_off(page: Any) -> Any:
    return page.evaluate(
        """() => [...document.querySelectorAll('table, svg.plot, math, p, dl, pre')].filter(each =>
             each.getClientRects().length && each.getBoundingClientRect().right > innerWidth + 1).map(each =>
             each.tagName + ' ' + each.textContent.trim().slice(0, 60))"""
    )
