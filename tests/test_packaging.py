"""The wheel: what is in it, and that it works in an empty environment, far from any checkout."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CONSTRAINTS = ROOT / "constraints.txt"
CARRIED = (
    "tubefoot/firmware/Makefile",
    "tubefoot/firmware/messages.toml",
    "tubefoot/firmware/finger_rig/finger_rig.ino",
    "tubefoot/firmware/simulator/bridge.c",
    "tubefoot/firmware/licences/arduino-core.txt",
    "tubefoot/firmware/licences/avr-libc.txt",
    "tubefoot/firmware/build/board.hex",
    "tubefoot/firmware/build/board.elf",
    "tubefoot/report/page.html.j2",
    "tubefoot/report/page.css",
    "tubefoot/report/viewer.js",
    "tubefoot/vendored/three/three.min.js",
    "tubefoot/vendored/three/LICENSE",
    "tubefoot/dashboard/static/index.html",
    "tubefoot/reduced/data/reference-12.toml",
    "tubefoot/lab/data/tofu.toml",
)
MARK = b"SPDX-License-Identifier: GPL"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True, timeout=900)
    (path,) = folder.glob("tubefoot-*.whl")
    return path


class Environment:
    """An empty virtual environment with the wheel and some extras, and a directory to work in."""

    def __init__(self, folder: Path, wheel: Path, extras: str):
        self.folder = folder
        subprocess.run([sys.executable, "-m", "venv", str(folder / "venv")], check=True, timeout=300)
        self.run("python", "-m", "pip", "install", "-q", "-c", str(CONSTRAINTS), f"{wheel}[{extras}]")

    def run(self, *words: str) -> str:
        environment = {
            **{key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")},
            "XDG_CACHE_HOME": str(self.folder / "cache"),
        }
        command = [str(self.folder / "venv" / "bin" / words[0]), *words[1:]]
        done = subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=3000
        )
        assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"
        return done.stdout

    def summary(self, name: str) -> dict:
        return json.loads((self.folder / name / "summary.json").read_text())


def test_the_wheel_carries_firmware_pages_and_licences(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert not [name for name in CARRIED if name not in names]
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests")]
    assert wheel.stat().st_size < 5e6


def test_nothing_in_the_wheel_is_under_the_gpl(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        field = re.search(r"^License-Expression: (.*)$", archive.read(metadata).decode(), re.MULTILINE)
        named = [name for name in archive.namelist() if MARK in archive.read(name)]
    assert field is not None
    assert set(field[1].split(" AND ")) == {"Apache-2.0", "MIT", "LGPL-2.1-or-later", "BSD-3-Clause"}
    assert named == []


@pytest.fixture(scope="module")
def laptop(tmp_path_factory, wheel):
    return Environment(tmp_path_factory.mktemp("laptop"), wheel, "lab,vision,twin")


def test_a_lab_laptop_has_no_finite_elements(laptop):
    listed = laptop.run("python", "-m", "pip", "list", "--format=freeze").lower()
    for heavy in ("mkl", "pyvista", "vtk", "build123d", "meshio", "netgen", "distributed", "optuna"):
        assert f"\n{heavy}==" not in listed


def test_a_lab_laptop_checks_drives_tracks_and_bends(laptop):
    assert "tubefoot/firmware" in laptop.run(
        "python", "-c", "from tubefoot.twin.firmware import FOLDER; print(FOLDER.as_posix())"
    )
    assert "pass" in laptop.run("tubefoot", "rig", "check", "--sim")
    laptop.run("tubefoot", "rig", "pulse", "forward", "--duty", "0.8", "--duration-s", "0.5", "--sim")
    laptop.run("tubefoot", "track", "virtual", "--frames", "10", "--no-video", "--out", "track")
    laptop.run("tubefoot", "bend", "30", "--sim", "--return", "--out", "bend")
    assert laptop.summary("bend")["settled"]


def test_the_demo_runs_from_a_wheel_in_an_empty_environment(tmp_path, wheel):
    everything = Environment(tmp_path, wheel, "all")
    everything.run("tubefoot", "demo", "--quick", "--out", "demo")
    assert (tmp_path / "demo" / "report.html").stat().st_size > 1e6
    claims = json.loads((tmp_path / "demo" / "claims.json").read_text())
    assert {"C1", "C5", "C6"} <= {claim["id"] for claim in claims if claim["verdict"] == "holds"}
