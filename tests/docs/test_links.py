"""Links between the Markdown files of the repository lead somewhere, headings included."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LINK = re.compile(r"!?\[[^\]]*\]\(([^()\s]+)\)")
MENTION = re.compile(r"`((?:docs|examples|src|scripts|tests|benchmarks|firmware)/[\w./-]+)`")
MADE = ("docs/api", "firmware/build")
"""Folders that a build makes."""


def kept_pages() -> list[Path]:
    listed = subprocess.run(
        ["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode == 0 and listed.stdout:
        return [ROOT / name for name in listed.stdout.split()]
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and MyST name them."""
    headings = re.findall(r"^#+ +(.+?) *$", prose(page), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken(page: Path) -> list[str]:
    """Links and mentions of files on a page that lead nowhere."""
    found = []
    text = prose(page)
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        made = any(path.is_relative_to(ROOT / folder) for folder in MADE)
        missing = not made and not path.exists()
        if missing or (anchor and path.suffix == ".md" and anchor not in anchors(path)):
            found.append(target)
    for mention in MENTION.findall(text):
        path = ROOT / mention.rstrip("/.")
        if not path.exists() and not any(path.is_relative_to(ROOT / folder) for folder in MADE):
            found.append(mention)
    return found


@pytest.mark.parametrize("page", kept_pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_links_and_named_files_are_there(page):
    assert broken(page) == []


def test_a_broken_link_is_found(tmp_path):
    (tmp_path / "there.md").write_text("# A heading: with signs\n")
    page = tmp_path / "page.md"
    page.write_text(
        "[a](there.md) [b](there.md#a-heading-with-signs) [c](gone.md) [d](there.md#gone) `docs/gone.md`\n"
        "```\n[code](is/no/link)\n```\n"
    )
    assert broken(page) == ["gone.md", "there.md#gone", "docs/gone.md"]
