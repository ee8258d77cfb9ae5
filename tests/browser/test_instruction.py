"""The whole loop through the page: a person types, the robot finds, the page says so."""

import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from services.runtime.run_directory import RunDirectory
from tests.running import Running

Up = Callable[..., AbstractContextManager[Running]]

_chromium = Path("/usr/bin/chromium")
_flags = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.skipif(not _chromium.exists(), reason=f"no browser at {_chromium}"),
]


def test_a_typed_instruction_ends_with_the_goal_confirmed(up: Up, tmp_path: Path) -> None:
    with up("--no-record", "--seed", "6", "--port", "18431") as system:
        system.wait_until_ready()
        address = RunDirectory.of(system.realm).info().address
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=str(_chromium), args=_flags)
            page = browser.new_page(viewport={"width": 640, "height": 400})
            page.goto(address)
            say = page.locator("label", has_text="Say").locator("xpath=ancestor::div[.//input][1]")
            say.locator("input").fill("go to the hydrant behind the cone", timeout=60_000)
            page.wait_for_timeout(150)  # as a hand would: see `type_and_enter`
            say.locator("input").press("Enter")
            confirmed = page.get_by_text(re.compile("goal confirmed")).first
            confirmed.wait_for(timeout=200_000)
            browser.close()
