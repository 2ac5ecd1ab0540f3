"""The built site: no warning, no broken link, nothing from the network, nothing serious for axe-core."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse

import pytest

from browsing import browser, page_of, serious_findings

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as `make docs` does it."""
    pytest.importorskip("sphinx")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going"]
    where = ["-d", str(folder / "doctrees"), str(ROOT / "docs"), str(folder / "html")]
    done = subprocess.run([*command, *where], capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr[-4000:]
    return folder / "html"


class Links(HTMLParser):
    """Identifiers, links, and what a page loads."""

    def __init__(self, path: Path):
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.ids |= {given[key] for key in ("id", "name") if given.get(key)}
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        if tag == "link" and "stylesheet" in given.get("rel", ""):
            self.loaded.append(given["href"])
        if tag in ("script", "img", "iframe") and given.get("src"):
            self.loaded.append(given["src"])


@pytest.fixture(scope="module")
def pages(site):
    return {path: Links(path) for path in site.rglob("*.html")}


def test_every_internal_link_leads_somewhere(pages):
    broken = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlparse(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            found = pages.get(target)
            anchor = unquote(parts.fragment)
            if not target.exists() or (anchor and found is not None and anchor not in found.ids):
                broken.append(f"{path.name} -> {link}")
    assert broken == []
    assert len(pages) > 20


def test_nothing_comes_from_the_network(site, pages):
    outside = {loaded for page in pages.values() for loaded in page.loaded if urlparse(loaded).netloc}
    assert outside == set()
    for style in site.rglob("*.css"):
        text = re.sub(r"/\*.*?\*/", "", style.read_text(encoding="utf-8"), flags=re.S)
        assert not re.search(r"url\(\s*['\"]?(https?:)?//", text), style
        assert "@import" not in text, style


@pytest.mark.parametrize(
    "name", ["index.html", "tutorial.html", "verification.html", "api/tubefoot.lab.html"]
)
def test_pages_fit_and_axe_finds_nothing_serious(site, name):
    with browser() as launched:
        for width in (1280, 390):
            with page_of(launched, (site / name).as_uri(), width, 844) as page:
                assert page.evaluate("document.documentElement.scrollWidth") <= width
                assert serious_findings(page) == []
