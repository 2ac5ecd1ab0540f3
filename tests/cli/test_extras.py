"""What a user is told whose installation lacks the extras of a verb."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tubefoot.cli.extras import EXTRAS, missing_package

ROOT = Path(__file__).parents[2]
WITHOUT = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {packages!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
sys.argv = ["tubefoot", *{words!r}]
from tubefoot.cli.main import main

main()
"""


def run_without(packages, words):
    code = WITHOUT.format(packages=packages, words=words)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)


def test_every_verb_has_its_extras():
    from tubefoot.cli.main import app

    verbs = {name for name in app if not name.startswith("-")}
    assert verbs == set(EXTRAS)


def test_every_extra_is_one_of_the_project():
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named = {extra for extras in EXTRAS.values() for extra in extras.split(",") if extra}
    assert named <= set(known)


@pytest.mark.parametrize(
    ("packages", "words", "extras"),
    [
        ({"jinja2"}, ["report", str(ROOT / "examples")], "fea"),
        ({"mcap"}, ["rig", "record", "--sim", "--seconds", "1"], "lab,twin"),
    ],
)
def test_a_missing_package_names_the_extras_and_no_traceback(packages, words, extras):
    done = run_without(packages, words)
    assert done.returncode == 2
    assert f"pip install 'tubefoot[{extras}]'" in done.stderr
    assert f"`tubefoot {words[0]}`" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_module_of_our_own_that_is_missing_is_a_bug_and_shown_as_one():
    code = WITHOUT.replace('.split(".")[0]', "").format(packages={"tubefoot.cli.report"}, words=["report"])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert "Traceback" in done.stderr


def test_an_unknown_verb_is_told_to_take_everything():
    assert "tubefoot[all]" in missing_package("scipy", ["--help"])
