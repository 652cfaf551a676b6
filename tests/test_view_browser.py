"""The interactive scene in a real browser, without network. Needs the extra ``browser`` and an installed Chromium."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from yarnverify.simulation.fabric import weave
from yarnverify.simulation.solids import Ball
from yarnverify.simulation.view import scene

api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed (extra: browser)")
pytest.importorskip("matplotlib", reason="matplotlib is not installed")
SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # WebGL without a graphics card


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, list[str]]]:
    """The page of a cloth that is bent over a ball in three frames, and what it should not have done."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if found is None:
        pytest.skip("no Chromium is installed (on Debian: apt install chromium)")
    cloth = weave("plain", (6, 6), tails=0.5e-3)
    frames = np.repeat(cloth.Q[None], 3, axis=0)
    for k, Q in enumerate(frames):
        points = cloth.points(Q)
        points[:, 2] = -60.0 * k * (points[:, 0] - 2.5e-3) ** 2
    ball = Ball((2.5e-3, 2.5e-3, -2.5e-3), 2e-3)
    path = scene(
        cloth, frames, tmp_path_factory.mktemp("scene") / "cloth.html", times=[0, 0.1, 0.2], title="bent", solids=[ball]
    )
    faults: list[str] = []
    with api.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=SOFTWARE)
        page = browser.new_context(viewport={"width": 800, "height": 600}, offline=True).new_page()
        page.on("console", lambda message: faults.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: faults.append(f"error: {error}"))
        page.on("request", lambda sent: faults.extend([] if sent.url.startswith("file:") else [sent.url]))
        page.goto(Path(path).as_uri())
        page.wait_for_selector("#tools button")
        yield page, faults
        browser.close()


def shot(page: Any) -> Any:
    from PIL import Image

    page.wait_for_timeout(300)
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)


def test_yarns_and_what_they_lie_on_are_drawn(opened: tuple[Any, list[str]]) -> None:
    page, faults = opened
    assert faults == [] and page.locator("#failed").is_hidden()
    middle = shot(page)[100:480, 150:600].reshape(-1, 3)
    blue = (middle[:, 2] > middle[:, 0] + 25).mean()
    ecru = (middle[:, 0] > middle[:, 2] + 25).mean()
    grey = ((np.ptp(middle, axis=1) < 25) & (middle.max(1) < 225)).mean()
    assert min(blue, ecru, grey) > 0.02
    assert page.inner_text("#title") == "bent" and page.inner_text("#time") == "t = 0.0 ms"
    assert "warp" in page.inner_text("#legend") and page.inner_text("#length").endswith("mm")


def test_time_colour_and_view_change_the_picture(opened: tuple[Any, list[str]]) -> None:
    page, faults = opened
    pictures = [shot(page)]
    page.locator("#slider").fill("2")
    pictures.append(shot(page))
    assert page.inner_text("#time") == "t = 200.0 ms"
    page.locator("select").select_option("bending angle")
    pictures.append(shot(page))
    assert "bending angle (°)" in page.inner_text("#legend") and len(page.locator("#ticks span").all()) >= 3
    page.get_by_role("button", name="top").click()
    pictures.append(shot(page))
    page.mouse.move(400, 300)
    page.mouse.down()
    page.mouse.move(500, 350, steps=4)
    page.mouse.up()
    pictures.append(shot(page))
    page.mouse.wheel(0, -400)
    pictures.append(shot(page))
    for before, after in pairwise(pictures):
        assert (np.abs(before - after).max(2) > 20).mean() > 0.01
    assert faults == []


def test_keys_turn_move_and_zoom(opened: tuple[Any, list[str]]) -> None:
    page, faults = opened
    page.locator("#view").focus()
    page.keyboard.press("0")
    start = shot(page)
    pictures = [start]
    for key in ("ArrowRight", "ArrowUp", "Shift+ArrowLeft", "+"):
        for _ in range(4):
            page.keyboard.press(key)
        pictures.append(shot(page))
    for before, after in pairwise(pictures):
        assert (np.abs(before - after).max(2) > 20).mean() > 0.01
    page.keyboard.press("0")
    assert (shot(page) == start).all()
    assert "arrow keys" in page.locator("#view").get_attribute("aria-label") and faults == []


def test_it_plays(opened: tuple[Any, list[str]]) -> None:
    page, faults = opened
    page.get_by_role("button", name="play").click()
    times = set()
    for _ in range(20):
        times.add(page.inner_text("#time"))
        page.wait_for_timeout(30)
    page.get_by_role("button", name="stop").click()
    assert len(times) >= 2 and faults == []
