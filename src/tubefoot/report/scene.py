"""Solved states of a run as compact geometry for the page's viewer: quantised and compressed.

Positions are 16-bit numbers within the box of all states (2 micrometres on a 100 mm finger), stresses 8-bit
numbers on the colour scale of their field. Of a half finger the half is kept; the viewer mirrors it.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.report.runs import RunRecord
from tubefoot.report.scale import ColourScale
from tubefoot.report.surface import ODD_IN_Y, Surface, read_surface

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIELDS = (
    ("von_mises_kpa", "von Mises stress [kPa]", False),
    ("s33_kpa", "S33, across the seam [kPa]", True),
    ("s13_kpa", "S13 [kPa]", True),
    ("s23_kpa", "S23 [kPa]", True),
)
"""Fields that can be chosen: name in the files, name for the reader, whether its scale is symmetrical."""
SUBDIVISIONS = 1
"""Faces of 27-node cells as eight triangles: half the linear resolution of the still pictures."""
SHARP_EDGE_DEG = 32.0
MOST_STATES = 12
LARGEST_RUN_BYTES = 2_500_000
"""Before compression; a longer path shows fewer of its states."""
COLOURS = 64
READ_FROM_CURVE = ("pressure_right_kpa", "pressure_left_kpa", "pumped_volume_ml", "bend_deg")


@dataclass(frozen=True)
class Shape:
    """The surface of a run in all shown states.

    steps : number of each state in the curve
    triangles : (n, 3), first those seen from outside, then walls of closed chambers, then the cut
    outside, walls : how many triangles of these two kinds; positions : (n_states, n_points, 3) [mm]
    values : field to (n_states, n_points); is_half : whether the mirror image is to be shown too
    """

    steps: Sequence[int]
    triangles: IntArray
    outside: int
    walls: int
    positions: FloatArray
    values: dict[str, FloatArray]
    is_half: bool


def read_shape(run: RunRecord) -> Shape | None:
    """The shape of a run in its kept states, at rest first; None where no field file was kept.

    run : a solve

    Raises ConfigError when a field file cannot be read.
    """
    if not run.is_solve or not run.states:
        return None
    kept = [step for step in sorted(run.states) if step in run.curve["step"]]
    if not kept:
        return None
    last = read_surface(run.states[kept[-1]], SUBDIVISIONS)
    shown = _spread(kept, _affordable(last))
    source, corners = _with_sharp_edges(last)
    triangles, outside, walls = _in_groups(last, corners)
    positions: list[FloatArray] = []
    values: dict[str, list[FloatArray]] = {field: [] for field, _, _ in FIELDS if field in last.values}
    for step in shown:
        surface = last if step == kept[-1] else read_surface(run.states[step], SUBDIVISIONS)
        if len(surface.rest) != len(last.rest):
            raise ConfigError(f"{run.states[step]} and {run.states[kept[-1]]} are of different meshes")
        positions.append(surface.deformed[source])
        for field, found in values.items():
            found.append(surface.value(field)[source])
    steps = list(shown)
    if 0 in run.curve["step"] and 0 not in steps:
        # The recorder keeps no field file of the state at rest: it is the mesh itself, without stress.
        steps, positions = [0, *steps], [last.rest[source], *positions]
        for found in values.values():
            found.insert(0, np.zeros(len(source)))
    return Shape(
        steps,
        triangles,
        outside,
        walls,
        np.array(positions),
        {field: np.array(found) for field, found in values.items()},
        last.is_half,
    )


def scene_of(runs: Sequence[tuple[RunRecord, Shape]]) -> dict[str, Any]:
    """What the viewer reads: scales shared by all runs, and for each run its states and packed arrays.

    runs : solves and their shapes
    """
    shown = [entry for entry in FIELDS if all(entry[0] in shape.values for _, shape in runs)]
    last = [_last_surface(shape) for _, shape in runs]
    scales = [ColourScale.of(field, name, last, signed) for field, name, signed in shown]
    fields = [
        {
            "key": scale.field,
            "name": scale.name,
            "low": scale.low,
            "high": scale.high,
            "odd": scale.field in ODD_IN_Y,
            "colours": _colours(scale.map_name),
        }
        for scale in scales
    ]
    ends = {scale.field: (scale.low, scale.high) for scale in scales}
    return {"fields": fields, "runs": [packed(run, shape, ends) for run, shape in runs]}


def packed(run: RunRecord, shape: Shape, scales: dict[str, tuple[float, float]]) -> dict[str, Any]:
    """One run for the viewer; its `data` are triangles, then for each state positions and fields.

    run : its record; shape : its geometry; scales : ends of each field's colour scale
    """
    low, high = shape.positions.min(axis=(0, 1)), shape.positions.max(axis=(0, 1))
    span = np.where(high > low, high - low, 1.0)
    parts = [shape.triangles.astype("<u4").tobytes()]
    for number, points in enumerate(shape.positions):
        parts.append(np.round((points - low) / span * 65535).astype("<u2").T.tobytes())
        for field, (bottom, top) in scales.items():
            share = (shape.values[field][number] - bottom) / (top - bottom)
            parts.append(np.round(np.clip(share, 0.0, 1.0) * 255).astype("u1").tobytes())
    rows = {int(step): place for place, step in enumerate(run.curve["step"])}
    return {
        "name": run.name,
        "half": shape.is_half,
        "points": int(shape.positions.shape[1]),
        "triangles": len(shape.triangles),
        "outside": shape.outside,
        "walls": shape.walls,
        "low": low.tolist(),
        "high": (low + span).tolist(),
        "states": [
            {key: float(run.curve[key][rows[step]]) for key in READ_FROM_CURVE} for step in shape.steps
        ],
        "data": b64encode(zlib.compress(b"".join(parts), 9)).decode(),
    }


def _affordable(surface: Surface) -> int:
    """How many states of a surface may be shown."""
    bytes_a_state = len(surface.rest) * (6 + len(FIELDS))
    return max(2, min(MOST_STATES, LARGEST_RUN_BYTES // bytes_a_state))


def _spread(kept: Sequence[int], most: int) -> list[int]:
    """At most so many of the kept steps, evenly spread, the last among them."""
    if len(kept) <= most:
        return list(kept)
    places = np.unique(np.round(np.linspace(0, len(kept) - 1, most)).astype(int))
    return [kept[place] for place in places]


def _with_sharp_edges(surface: Surface) -> tuple[IntArray, IntArray]:
    """Points doubled along sharp edges, so that light does not bleed over them.

    First (n,) the surface's point of each new point, then (n_triangles, 3) corners among the new points.
    """
    a, b, c = surface.rest[surface.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    corner_point, corner_normal = surface.triangles.ravel(), np.repeat(normals, 3, axis=0)
    order = np.argsort(corner_point, kind="stable")
    source: list[int] = []
    corners = np.empty(corner_point.size, dtype=np.int64)
    threshold = np.cos(np.radians(SHARP_EDGE_DEG))
    begin = 0
    ends = np.flatnonzero(np.diff(corner_point[order], append=-1)) + 1
    for end in ends.tolist():
        around, begin = order[begin:end], end
        leaders: list[tuple[FloatArray, int]] = []
        for corner in around:
            normal = corner_normal[corner]
            place = next((number for leader, number in leaders if leader @ normal > threshold), None)
            if place is None:
                place = len(source)
                source.append(int(corner_point[corner]))
                leaders.append((normal, place))
            corners[corner] = place
    return np.array(source), corners.reshape(-1, 3)


def _in_groups(surface: Surface, corners: IntArray) -> tuple[IntArray, int, int]:
    """Corners in the order outside, chamber walls, cut; and how many triangles the first two are."""
    cut = surface.cut_triangles if surface.is_half else np.zeros(len(corners), dtype=bool)
    outer = np.zeros(len(corners), dtype=bool)
    outer[~cut] = surface.shell_of_largest_y(~cut)
    return (
        np.vstack([corners[outer], corners[~outer & ~cut], corners[cut]]),
        int(outer.sum()),
        int((~outer & ~cut).sum()),
    )


def _last_surface(shape: Shape) -> Surface:
    return Surface(
        shape.positions[0],
        shape.positions[-1],
        shape.triangles,
        {field: values[-1] for field, values in shape.values.items()},
    )


def _colours(map_name: str) -> list[str]:
    """A colour map as hexadecimal colours from its low end to its high one."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps[map_name](share)) for share in np.linspace(0.0, 1.0, COLOURS)]
