"""A page in a real browser, from ``file://`` and with no network: Debian's Chromium, driven by Playwright."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

#: Draws 3-D on the processor, as machines without a graphics card need.
_ARGUMENTS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@contextmanager
def opened(path: Path, width: int = 1300, height: int = 900) -> Iterator[Any]:
    """A page, open; errors on its console, and whatever it asks the network for, fail the test when the block ends."""
    with watched(path, width, height) as (page, wrong):
        yield page
    assert wrong == []


@contextmanager
def watched(path: Path, width: int = 1300, height: int = 900) -> Iterator[tuple[Any, list[str]]]:
    """A page, open, and the list that errors on its console and addresses on the network are added to."""
    playwright = pytest.importorskip("playwright.sync_api", reason="drives a browser")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        pytest.skip("chromium is not installed")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=program, args=list(_ARGUMENTS))
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(120_000)
        wrong: list[str] = []
        page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda one: wrong.append(one.url) if one.url.startswith(("http:", "https:")) else None)
        page.goto(path.resolve().as_uri())
        yield page, wrong
        browser.close()
