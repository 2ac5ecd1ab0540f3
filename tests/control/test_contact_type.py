"""Planar and curved contact from two angles."""

import pytest

from tubefoot.control.contact_type import classify_contact
from tubefoot.units import DEG


@pytest.mark.parametrize(
    ("theta1", "theta2", "kind"),
    [
        (-8.0, -1.0, "planar"),
        (-8.0, 0.5, "planar"),
        (-4.0, 5.0, "curved"),
        (-10.0, -9.8, "even"),
        (0.2, 3.0, "unknown"),
    ],
)
def test_kinds(theta1: float, theta2: float, kind: str) -> None:
    assert classify_contact(theta1 * DEG, theta2 * DEG).kind == kind
    assert classify_contact(-theta1 * DEG, -theta2 * DEG).kind == kind


def test_confidence_is_even_on_the_border_and_grows_away_from_it() -> None:
    border = classify_contact(-8 * DEG, 2 * DEG).confidence
    assert border == pytest.approx(0.5, abs=0.01)
    assert classify_contact(-8 * DEG, 5 * DEG).confidence > 0.99
    assert classify_contact(-8 * DEG, 5 * DEG, sigma=3 * DEG).confidence < 0.9
