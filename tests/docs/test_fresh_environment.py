"""README and tutorial as a newcomer types them: a fresh clone, a fresh environment, every command."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from code_blocks import RUNS, blocks_of

ROOT = Path(__file__).parents[2]
NOT_HERE = ("make demo", "make test")
"""Lines of the README that would take the time of all tests and of the full demo."""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A clone with its own environment, built by the one command that the tutorial names."""
    folder = tmp_path_factory.mktemp("fresh") / "tubefoot"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(folder)], check=True, timeout=300)
    subprocess.run(["make", "-s", "setup"], cwd=folder, check=True, timeout=3600)
    return folder


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md"])
def test_every_command_of_a_page_runs_in_a_fresh_clone(page, clone):
    environment = {
        **{key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")},
        "PATH": f"{clone / '.venv' / 'bin'}:{os.environ['PATH']}",
    }
    ran = 0
    for block in blocks_of(clone / page):
        if block.marked("file"):
            (clone / block.mark.split(":")[1].strip()).write_text(block.text, encoding="utf-8")
        if block.language not in RUNS or block.marked("bench"):
            continue
        lines = [line for line in block.text.split("\n") if not line.startswith(NOT_HERE)]
        text = "\n".join(lines)
        command = ["sh", "-e", "-c", text] if block.language == "sh" else ["python", "-c", text]
        done = subprocess.run(
            command, cwd=clone, env=environment, capture_output=True, text=True, timeout=3600
        )
        assert done.returncode == 0, f"{block.place}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
        ran += bool(text.strip())
    assert ran > 1


def test_the_two_commands_of_the_readme_are_there(clone):
    for target in ("demo", "test", "docs"):
        done = subprocess.run(["make", "-n", target], cwd=clone, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
