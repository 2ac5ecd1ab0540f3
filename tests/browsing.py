"""Pages in Debian's headless Chromium: for tests of the report, the dashboard and the documentation."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
NPM_FOLDER = ROOT / "build" / "npm"
SOFTWARE_OPENGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SERIOUS = ("serious", "critical")


@contextmanager
def browser() -> Iterator[Any]:
    """A Playwright browser without a display, with software WebGL; fails where there is no Chromium."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.fail("pages cannot be tested: no Chromium here; Debian: apt-get install chromium")
    with sync_playwright() as driver:
        launched = driver.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", "--disable-dev-shm-usage", *SOFTWARE_OPENGL]
        )
        try:
            yield launched
        finally:
            launched.close()


@contextmanager
def page_of(browsing: Any, address: str, width: int = 1280, height: int = 900) -> Iterator[Any]:
    """A page at an address; at its end an error in its scripts fails the test."""
    context = browsing.new_context(viewport={"width": width, "height": height})
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    try:
        page.goto(address)
        yield page
    finally:
        context.close()
    assert faults == []


def axe_source() -> str:
    """The text of axe-core, installed by npm into `build/npm` at first use; fails where there is no npm."""
    script = NPM_FOLDER / "node_modules" / "axe-core" / "axe.min.js"
    NPM_FOLDER.mkdir(parents=True, exist_ok=True)
    with (NPM_FOLDER / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not script.exists():
            npm = shutil.which("npm")
            if npm is None:
                pytest.fail("axe-core cannot be installed: no npm here; Debian: apt-get install npm")
            shutil.copy(ROOT / "tests" / "package.json", NPM_FOLDER)
            command = [npm, "install", "--silent", "--no-package-lock", "--no-audit"]
            done = subprocess.run(command, cwd=NPM_FOLDER, capture_output=True, text=True, timeout=300)
            if done.returncode:
                pytest.fail(f"npm could not install axe-core: {done.stderr[-300:]}")
    return script.read_text(encoding="utf-8")


def serious_findings(page: Any) -> list[str]:
    """What axe-core finds serious or critical on a page: rule, how many places, and the first of them."""
    page.evaluate(axe_source())
    # Without `preload`, which asks for style sheets once more: of a page on disk the browser refuses them.
    violations = page.evaluate("axe.run(document, {preload: false}).then(found => found.violations)")
    return [
        f"{found['id']} ({found['impact']}) in {len(found['nodes'])} places, the first: "
        f"{found['nodes'][0]['html'][:200]} {found['nodes'][0].get('failureSummary', '')}"
        for found in violations
        if found["impact"] in SERIOUS
    ]
