"""Solids to be meshed with tetrahedra, their faces named by what they are: a quarter of the finger, its body.

The finger mirrors at the mid-plane y = 0 and at the centre plane x = 0 but for lip and groove, registration
pins and marker seats, which are left out. With ports, both tubes of the quarter are there, bonded into the
caps, their bores open to the chamber; the outer half of what stands out is filled, as plug and hose fill it,
so that the fluid is closed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tubefoot.design import cad, solids
from tubefoot.design.cad import Solid
from tubefoot.design.layout import tube_axis
from tubefoot.design.named_step import FacePlace, write_named_step
from tubefoot.design.outline import chamber

if TYPE_CHECKING:
    from tubefoot.design.finger import FingerDesign

BODY, TUBES = "body", "tubes"
NEAR = 1e-6
"""Distance within which a face lies in a plane [mm]."""
PROBE = 0.02
"""How far from a face the fluid is looked for [mm]."""


def quarter_solids(design: FingerDesign, ports: bool) -> dict[str, Solid]:
    """Name to solid of the quarter x >= 0, y >= 0: the soft body, with ports also the rigid tubes.

    design : the finger; ports : whether tubes and bores are there
    """
    body = solids.whole_body(design)
    if not ports:
        return {BODY: cad.first_quadrant(body)}
    x, outer = tube_axis(design.profile, design.ports), design.ports.outer_diameter_mm / 2
    foot, cap = {True: design.profile.bellows_length, False: 0.0}, design.profile.cap
    tubes, sockets = [], []
    for top, z in foot.items():
        up = 1.0 if top else -1.0
        sockets.append(cad.cylinder((x, 0.0, z), (0, 0, up), outer, cap + 1.0))
        tube = cad.cylinder((x, 0.0, z), (0, 0, up), outer, cap + design.ports.length_mm)
        bore = cad.cylinder((x, 0.0, z), (0, 0, up), design.ports.bore_mm / 2, _bore_depth(design))
        tubes.append(cad.first_quadrant(cad.cut(tube, [bore])))
    return {BODY: cad.first_quadrant(cad.cut(body, sockets)), TUBES: cad.grouped(tubes)}


def write_quarter(path: Path, design: FingerDesign, ports: bool) -> Path:
    """The path of a STEP file of the quarter, solids and faces named.

    path : file to write; design : the finger; ports : whether tubes and bores are there
    """
    return write_named_step(
        path, quarter_solids(design, ports), lambda solid, place: face_role(design, ports, solid, place)
    )


def write_body(path: Path, design: FingerDesign) -> Path:
    """The path of a STEP file of the whole body without ports, its faces named as `solve --mesh` wants them.

    path : file to write; design : the finger

    The names are base, tip, cavity_right, cavity_left and outside.
    """
    p = design.profile
    core = p.height / 2 - p.side_wall

    def name(_: str, place: FacePlace) -> str:
        # A lid has the outline of its chamber: its middle need not lie on it.
        is_lid = np.allclose(np.abs([place.low[1], place.high[1]]), core, atol=NEAR)
        is_lid &= place.high[1] - place.low[1] < NEAR
        if is_lid or _is_fluid(design, False, place.point + PROBE * place.normal):
            return "cavity_right" if place.point[0] > 0 else "cavity_left"
        ends = {"base": -p.cap, "tip": p.bellows_length + p.cap}
        flat = [role for role, z in ends.items() if max(abs(place.low[2] - z), abs(place.high[2] - z)) < NEAR]
        return flat[0] if flat else "outside"

    return write_named_step(path, {BODY: solids.whole_body(design)}, name)


def face_role(design: FingerDesign, ports: bool, solid: str, place: FacePlace) -> str:
    """What a face of the quarter is, as the finite elements call it.

    design : the finger; ports : whether tubes and bores are there
    solid : name of the face's solid; place : where the face lies
    """
    p = design.profile
    low, high = place.low, place.high
    planes = [(0, 0.0, "centre_plane"), (1, 0.0, "mid_plane")]
    if solid == BODY:
        core = p.height / 2 - p.side_wall
        planes += [(1, p.height / 2, "side"), (1, core, "lid")]
        planes += [(2, -p.cap, "base"), (2, p.bellows_length + p.cap, "tip")]
    for axis, value, role in planes:
        if abs(low[axis] - value) < NEAR and abs(high[axis] - value) < NEAR:
            return role
    if not _is_fluid(design, ports, place.point + PROBE * place.normal):
        return "tube_outside" if solid == TUBES else _outside_role(design, place)
    if high[2] < NEAR or low[2] > p.bellows_length - NEAR:
        flat = high[2] - low[2] < NEAR and (abs(low[2]) < NEAR or abs(low[2] - p.bellows_length) < NEAR)
        return "cap_inside" if flat else "bore_inside"
    if high[0] < p.partition_face + NEAR:
        return "partition_inside"
    if high[0] < p.valley_inside + NEAR:
        return "valley_inside"
    return _fold_role(place, p.valley_inside, p.slot_end) + "_inside"


def _outside_role(design: FingerDesign, place: FacePlace) -> str:
    p = design.profile
    if place.high[2] < NEAR or place.low[2] > p.bellows_length - NEAR:
        return "cap_outside"
    if place.high[0] < p.valley_outside + NEAR:
        return "valley_outside"
    return _fold_role(place, p.valley_outside, p.crest_outside) + "_outside"


def _fold_role(place: FacePlace, valley: float, crest: float) -> str:
    """flank, crest or valley; a fillet belongs to the crest or valley that it rounds."""
    middle = (place.low[0] + place.high[0]) / 2
    if place.low[0] > crest - NEAR:
        return "crest"
    if place.is_plane:
        return "flank"
    return "valley" if middle < (valley + crest) / 2 else "crest"


def _is_fluid(design: FingerDesign, ports: bool, point: np.ndarray) -> bool:
    p = design.profile
    x, y, z = np.abs(point[0]), abs(point[1]), point[2]
    if ports:
        along = -z if z < 0 else z - p.bellows_length
        off_axis = np.hypot(x - tube_axis(p, design.ports), y)
        if 0 < along < _bore_depth(design) and off_axis < design.ports.bore_mm / 2:
            return True
    return bool(y < p.height / 2 - p.side_wall and _within(chamber(p).points(), float(x), float(z)))


def _within(polygon: np.ndarray, x: float, z: float) -> bool:
    """Whether a point lies in a polygon (n, 2), by the number of edges to its right."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    crosses = (a[:, 1] > z) != (b[:, 1] > z)
    a, b = a[crosses], b[crosses]
    at = a[:, 0] + (z - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(at > x) % 2)


def _bore_depth(design: FingerDesign) -> float:
    """From the chamber to where the bore is filled [mm]."""
    return design.profile.cap + design.ports.length_mm / 2
