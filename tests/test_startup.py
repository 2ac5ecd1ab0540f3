"""What is imported when: a quick start-up and light bench laptops are kept by what is not imported."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = {"build123d", "cv2", "matplotlib", "mcap", "mujoco", "numba", "pandas", "pyvista", "scipy"}
ROOT = Path(__file__).parents[1]


def imported_by(code: str) -> set[str]:
    """Names of all modules that a fresh interpreter holds after some code."""
    tail = "\nimport sys, json; print(); print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code + tail], capture_output=True, text=True, check=True, timeout=120
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


HELP = """
from tubefoot.cli.main import app
app(["--help"], exit_on_error=False)
"""


def test_help_imports_nothing_heavy():
    modules = imported_by(HELP)
    assert "tubefoot.cli.main" in modules
    assert not HEAVY & modules
    ours = ("tubefoot.fea", "tubefoot.design", "tubefoot.twin", "tubefoot.lab", "tubefoot.vision")
    assert not {name for name in modules if name.startswith(ours)}


@pytest.mark.parametrize("package", ["lab", "vision", "control", "reduced"])
def test_what_runs_at_the_bench_imports_no_simulator(package):
    folder = ROOT / "src" / "tubefoot" / package
    names = [f"tubefoot.{package}.{path.stem}" for path in folder.glob("*.py") if path.stem != "__init__"]
    if not names:
        pytest.skip(f"tubefoot.{package} has no modules yet")
    modules = imported_by("\n".join(f"import {name}" for name in names))
    forbidden = ("tubefoot.fea", "tubefoot.design", "tubefoot.study", "tubefoot.twin", "mujoco", "numba")
    assert not {name for name in modules if name.startswith(forbidden)}


def test_import_contracts_hold():
    checker = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([str(checker)], cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout[-3000:]
    assert "0 broken" in done.stdout
