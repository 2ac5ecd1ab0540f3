"""`tubefoot solve --grasp`: its examples can be read, and what does not go with it is refused."""

from pathlib import Path

import pytest

from tubefoot.cli.solve import solve
from tubefoot.config import load_settings
from tubefoot.errors import ConfigError
from tubefoot.fea.grasp_settings import GraspSettings

EXAMPLES = Path(__file__).parents[2] / "examples"
DESIGN = EXAMPLES / "designs" / "reference-3.toml"
GRASP = EXAMPLES / "grasps" / "tofu-front.toml"


@pytest.mark.parametrize("path", sorted((EXAMPLES / "grasps").glob("*.toml")), ids=lambda path: path.stem)
def test_examples_are_what_the_verb_takes(path):
    grasp = load_settings(path, GraspSettings)
    assert path.stem.startswith(grasp.object.name)
    width = {"tofu-front": 20.0, "tofu-side": 15.0, "blueberry-front": 15.0, "blueberry-side": 12.0}
    assert grasp.object.sizes_mm[0] == width[path.stem]


def test_the_file_of_the_grasp_says_how_far(tmp_path):
    with pytest.raises(ConfigError, match="leave --until out"):
        solve(DESIGN, grasp=GRASP, until="bend_deg=10", out=tmp_path)


def test_a_grasp_needs_a_design(tmp_path):
    with pytest.raises(ConfigError, match="--grasp goes with a design"):
        solve(mesh=tmp_path / "part.msh", grasp=GRASP, out=tmp_path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml: no such file"):
        solve(DESIGN, grasp=tmp_path / "none.toml", out=tmp_path)


def test_a_grasp_is_not_solved_in_time(tmp_path):
    with pytest.raises(ConfigError, match="not viscoelastic"):
        solve(DESIGN, grasp=GRASP, viscoelastic=True, out=tmp_path)
