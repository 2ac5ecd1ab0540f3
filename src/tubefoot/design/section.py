"""What the plane y = 0 cuts besides the body: tubes, pins and base, as polygons in x-z, for drawings."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design.layout import base_of, pin_places, tube_axis
from tubefoot.design.surface import FloatArray

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign


def tube_walls(design: FingerDesign) -> list[FloatArray]:
    """The walls of the four tubes, two each, (4, 2) corners as (x, z) [mm].

    design : the finger
    """
    inner, outer = design.ports.bore_mm / 2, design.ports.outer_diameter_mm / 2
    spans = _tube_spans(design)
    return [_block(x + side * inner, x + side * outer, *z) for x, z in spans for side in (-1.0, 1.0)]


def tube_bores(design: FingerDesign) -> list[FloatArray]:
    """The bores of the four tubes, (4, 2) corners as (x, z) [mm].

    design : the finger
    """
    inner = design.ports.bore_mm / 2
    return [_block(x - inner, x + inner, *z) for x, z in _tube_spans(design)]


def pin_circles(design: FingerDesign) -> list[FloatArray]:
    """The registration pins, (n, 2) corners as (x, z) [mm].

    design : the finger
    """
    radius = design.registration.pin_diameter_mm / 2
    return [circle(place, radius) for place in pin_places(design)]


def base_pieces(design: FingerDesign) -> list[FloatArray]:
    """The base with its socket, cut through both tube holes, (n, 2) corners as (x, z) [mm].

    design : the finger
    """
    mount = base_of(design)
    hole = design.ports.outer_diameter_mm / 2 + design.base.tube_clearance_mm
    axis = tube_axis(design.profile, design.ports)
    right = np.array(
        [
            (mount.cap_half_x, mount.seat),
            (mount.cap_half_x, mount.rim),
            (mount.socket_half_x, mount.rim),
            (mount.socket_half_x, mount.bottom),
            (axis + hole, mount.bottom),
            (axis + hole, mount.seat),
        ]
    )
    return [right, right * [-1.0, 1.0], _block(hole - axis, axis - hole, mount.bottom, mount.seat)]


def circle(centre: tuple[float, float], radius: float) -> FloatArray:
    """Corners of a circle drawn as a polygon, (36, 2).

    centre : its centre
    radius : its radius
    """
    angle = np.linspace(0.0, 2 * pi, 37)[:-1]
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _tube_spans(design: FingerDesign) -> list[tuple[float, tuple[float, float]]]:
    """Axis and extent along z of every tube."""
    profile = design.profile
    axis, reach = tube_axis(profile, design.ports), profile.cap + design.ports.length_mm
    ends = ((-reach, 0.0), (profile.bellows_length, profile.bellows_length + reach))
    return [(x, end) for x in (-axis, axis) for end in ends]


def _block(x_from: float, x_to: float, z_from: float, z_to: float) -> FloatArray:
    return np.array([(x_from, z_from), (x_to, z_from), (x_to, z_to), (x_from, z_to)])
