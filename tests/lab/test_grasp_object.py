"""Objects to be grasped: what their files may say, and what follows from them."""

from pathlib import Path

import pytest

from tubefoot.errors import ConfigError
from tubefoot.lab.grasp_object import GraspObject, known_object, load_object

BOUNDS = {"contact_force_n": 1.0}


def box(**changes: object) -> GraspObject:
    """A box of 20 x 15 x 10 mm with other keys."""
    keys = {
        "name": "box",
        "shape": "box",
        "size_mm": (20.0, 15.0, 10.0),
        "modulus_kpa": 30.0,
        "damage": BOUNDS,
    }
    return GraspObject.model_validate(keys | changes)


def test_tofu_is_what_its_source_says() -> None:
    tofu = known_object("tofu")
    assert tofu.modulus_kpa == pytest.approx(3 * 9.6)
    assert tofu.damage.compression_kpa == 2.88
    assert tofu.damage.tension_kpa == 3.54


def test_side_pose_turns_about_its_axis() -> None:
    assert box().sizes("side") == (15.0, 20.0, 10.0)
    assert box(side_axis="y").sizes("side") == (10.0, 15.0, 20.0)
    assert known_object("blueberry").sizes("side")[0] == 12.0


def test_box_firmness_is_that_of_a_bar() -> None:
    assert box().firmness("front") == pytest.approx(0.030 * 15 * 10 / 20)


def test_weight_of_a_sphere() -> None:
    ball = box(shape="sphere", size_mm=(10.0, 10.0, 10.0), density_g_per_cm3=2.0)
    assert ball.weight == pytest.approx(3.14159265 / 6 * 2e-3 * 9.80665, rel=1e-6)


def test_radius_of_curvature_of_a_flat_spheroid() -> None:
    berry = known_object("blueberry")
    assert berry.radius("front") == pytest.approx((15.0 * 12.0) / (2 * 15.0))
    assert berry.radius("side") == pytest.approx((15.0 * 15.0) / (2 * 12.0))


def test_a_cylinder_is_round_at_its_side_and_flat_at_its_ends() -> None:
    can = box(shape="cylinder", size_mm=(20.0, 20.0, 60.0), side_axis="y")
    assert can.radius("front") == can.size_mm[0] / 2
    assert can.face_area("front") == 20.0 * 60.0
    assert can.radius("side") == float("inf")
    assert can.firmness("side") == pytest.approx(0.030 * 3.14159265 * 10**2 / 60)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"size_mm": (20.0, 15.0, 0.2)}, "along z is 0.2 mm"),
        ({"shape": "sphere"}, "three equal sizes"),
        ({"shape": "cylinder"}, "equal sizes along x and y"),
        ({"shape": "mesh"}, "mesh_file"),
        ({"mesh_file": "a.stl"}, "mesh_file"),
        ({"damage": {}}, "at least one damage bound"),
    ],
)
def test_impossible_objects_are_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        box(**changes)


def test_unknown_name_and_missing_mesh(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"tofu, blueberry, or the path of a .toml"):
        load_object("tofuu")
    file = tmp_path / "thing.toml"
    file.write_text(
        'name = "t"\nshape = "mesh"\nmesh_file = "no.stl"\nmass_g = 3\nsize_mm = [9.0, 9.0, 9.0]\n'
        "modulus_kpa = 100\n[damage]\ncontact_force_n = 1\n"
    )
    with pytest.raises(ConfigError, match=r"no.stl does not exist"):
        load_object(str(file))
