"""Damage: contact pressures against Hertz's tables, margins against their definition."""

import math

import pytest

from tubefoot.control.damage import WALL_PLANE_MODULUS, contact_pressure, damage_of
from tubefoot.lab.grasp_object import known_object

BERRY, TOFU = known_object("blueberry"), known_object("tofu")


def test_pressure_integrates_to_the_force() -> None:
    """2/3 of the peak over the circular patch is the force, whose radius shortens by a^2 / R."""
    peak, _ = contact_pressure(BERRY, "front", 0.05)
    patch = (3 * 0.05 / (2 * math.pi * peak)) ** 0.5
    plane = 0.8 / (1 - 0.45**2)
    both = plane * WALL_PLANE_MODULUS / (plane + WALL_PLANE_MODULUS)
    approach = patch**2 / BERRY.radius("front")
    assert 4 / 3 * both * BERRY.radius("front") ** 0.5 * approach**1.5 == pytest.approx(0.05, rel=1e-9)


def test_pressure_grows_with_the_cube_root_and_the_square_root() -> None:
    assert contact_pressure(BERRY, "front", 0.8)[0] == pytest.approx(
        2 * contact_pressure(BERRY, "front", 0.1)[0]
    )
    assert contact_pressure(TOFU, "front", 0.4)[0] == pytest.approx(
        2 * contact_pressure(TOFU, "front", 0.1)[0]
    )


def test_margins_are_bounds_over_loads() -> None:
    damage = damage_of(TOFU, "front", 0.3)
    assert damage.compression_kpa == pytest.approx(1.0)
    assert damage.margins["compression_kpa"] == pytest.approx(2.88)
    assert damage.margin == min(damage.margins.values())
    assert damage_of(TOFU, "front", 0.3 * 2.9).margin < 1.0


def test_a_crest_loads_a_block_locally() -> None:
    """What finite elements found at 0.084 N, within their scatter; round objects are not judged so."""
    damage = damage_of(TOFU, "front", 0.15, 0.084)
    assert damage.local_kpa == pytest.approx(3.3, rel=0.05)
    assert damage.local_margin == pytest.approx(2.88 / damage.local_kpa)
    assert math.isinf(damage_of(BERRY, "front", 0.15).local_margin)


def test_no_load_no_damage() -> None:
    assert math.isinf(damage_of(BERRY, "side", 0.0).margin)
