"""Every block of code of README and documentation runs, or says why not."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from code_blocks import LANGUAGES, RUNS, Block, blocks_of

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MARKS = ("", "slow", "file", "bench", "elsewhere")


def code(page: Path) -> list[Block]:
    return list(blocks_of(page))


WITH_CODE = [page for page in PAGES if any(block.language in RUNS for block in code(page))]
QUICK = [
    page for page in WITH_CODE if any(block.language in RUNS and block.mark == "" for block in code(page))
]
SLOW = [page for page in WITH_CODE if any(block.marked("slow") for block in code(page))]


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_every_block_says_what_it_is(page):
    for block in code(page):
        assert block.language in LANGUAGES, f"{block.place}: language `{block.language}`"
        assert block.mark.split(":")[0] in MARKS, f"{block.place}: mark `{block.mark}`"
        if block.language == "toml":
            assert tomllib.loads(block.text), block.place
        if block.language == "python":
            compile(block.text, block.place, "exec")
        if block.marked("elsewhere"):
            assert (ROOT / block.mark.split(":")[1].strip()).exists(), block.place


@pytest.mark.parametrize("page", WITH_CODE, ids=named)
def test_every_command_line_is_one_that_the_program_takes(page):
    from tubefoot.cli.main import app

    for block in code(page):
        if block.language == "sh":
            for words in block.commands:
                if "--help" not in words and len(words) > 1:
                    app.parse_args(words[1:], exit_on_error=False, print_error=False)


MENTION = re.compile(r"`(tubefoot [^`\n]+)`")
PLACEHOLDER = re.compile(r"\b[A-Z]{4,}\b|\.\.\.|[|<\[]")


def spoken_commands(page: Path) -> list[str]:
    """Command lines in running text that could be typed as they stand."""
    text = page.read_text(encoding="utf-8")
    return [line for line in MENTION.findall(text) if not PLACEHOLDER.search(line) and len(line.split()) > 2]


@pytest.mark.parametrize("page", [page for page in PAGES if spoken_commands(page)], ids=named)
def test_commands_in_running_text_are_ones_that_the_program_takes(page):
    from cyclopts.exceptions import MissingArgumentError

    from tubefoot.cli.main import app

    for line in spoken_commands(page):
        words = shlex.split(line)[1:]
        if "--help" in words:
            continue
        # A verb or an option that is spoken of without its value is known all the same.
        with contextlib.suppress(MissingArgumentError):
            app.parse_args(words, exit_on_error=False, print_error=False)


def run_page(page: Path, directory: Path, marks: tuple[str, ...]) -> int:
    """How many blocks of a page ran, one after the other, in a directory with the examples in it."""
    (directory / "examples").symlink_to(ROOT / "examples")
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "COLUMNS": "100",
    }
    ran = 0
    for block in code(page):
        if block.marked("file"):
            (directory / block.mark.split(":")[1].strip()).write_text(block.text, encoding="utf-8")
        elif block.language in RUNS and block.mark in marks:
            shell = ["sh", "-e", "-c", block.text]
            command = shell if block.language == "sh" else [sys.executable, "-c", block.text]
            done = subprocess.run(
                command, cwd=directory, env=environment, capture_output=True, text=True, timeout=3600
            )
            assert done.returncode == 0, f"{block.place}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
            ran += 1
    return ran


@pytest.mark.parametrize("page", QUICK, ids=named)
def test_the_quick_blocks_of_a_page_run(page, tmp_path):
    assert run_page(page, tmp_path, ("",)) > 0


@pytest.mark.slow
@pytest.mark.parametrize("page", SLOW, ids=named)
def test_all_blocks_of_a_page_run(page, tmp_path):
    assert run_page(page, tmp_path, ("", "slow")) > 0


def test_a_block_that_fails_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("Text.\n\n```sh\ntrue\n```\n\n```python\nassert 1 == 2\n```\n")
    (tmp_path / "run").mkdir()
    with pytest.raises(AssertionError, match=r"page\.md:7"):
        run_page(page, tmp_path / "run", ("",))
    page.write_text("```sh\nfalse\ntrue\n```\n")
    (tmp_path / "again").mkdir()
    with pytest.raises(AssertionError, match=r"page\.md:1"):
        run_page(page, tmp_path / "again", ("",))
