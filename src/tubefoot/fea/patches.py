"""Grids of biquadratic quadrilaterals between curves: lines, filleted polylines, ruled patches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

Curve = Callable[[FloatArray], FloatArray]
"""Parameters in [0, 1] to points (n, 2)."""


@dataclass(frozen=True)
class Patch:
    """A grid of biquadratic cells: points (2 n + 1, 2 m + 1, 2), with the part and side of its cells."""

    grid: FloatArray
    part: str
    side: int

    def mirrored(self) -> Patch:
        """Its mirror image under x -> -x."""
        return Patch(self.grid[:, ::-1] * [-1.0, 1.0], self.part, -self.side)


def line_nodes(n: int) -> FloatArray:
    """Parameters of the nodes of n quadratic cells on a line, (2 n + 1,) from 0 to 1.

    n : number of cells
    """
    return np.linspace(0.0, 1.0, 2 * n + 1)


def line(start: FloatArray, end: FloatArray) -> Curve:
    """A straight line.

    start, end : (2,) [mm]
    """
    return lambda t: start + (end - start) * np.asarray(t)[:, None]


def polyline_with_fillets(corners: FloatArray, radii: list[float]) -> list[Curve]:
    """The pieces of a polyline between its corners, a filleted corner replaced by the middle of its arc.

    corners : (n, 2); radii : one for each inner corner
    """
    pieces: list[list[tuple[FloatArray, FloatArray, FloatArray | None]]] = [[] for _ in corners[:-1]]
    starts = corners[0]
    for k, radius in enumerate(radii, start=1):
        into, out = (_unit(corners[k] - corners[k - 1]), _unit(corners[k + 1] - corners[k]))
        half_turn = 0.5 * np.arccos(np.clip(into @ out, -1.0, 1.0))
        setback = radius * np.tan(half_turn)
        begin, end = corners[k] - setback * into, corners[k] + setback * out
        bisector = _unit(out - into)
        centre = corners[k] + bisector * radius / np.cos(half_turn)
        middle = centre - bisector * radius
        pieces[k - 1].append((starts, begin, None))
        if radius > 0:
            pieces[k - 1].append((begin, middle, centre))
            pieces[k].append((middle, end, centre))
        starts = end
    pieces[-1].append((starts, corners[-1], None))
    return [_chain(piece) for piece in pieces]


def _unit(vector: FloatArray) -> FloatArray:
    return vector / np.linalg.norm(vector)


def _chain(segments: list[tuple[FloatArray, FloatArray, FloatArray | None]]) -> Curve:
    """Lines and arcs end to end, by arc length."""
    lengths = []
    for start, end, centre in segments:
        chord = float(np.linalg.norm(end - start))
        if centre is None:
            lengths.append(chord)
        else:
            radius = float(np.linalg.norm(start - centre))
            lengths.append(2 * radius * np.arcsin(min(1.0, chord / (2 * radius))))
    bounds = np.concatenate([[0.0], np.cumsum(lengths)])

    def curve(t: FloatArray) -> FloatArray:
        at = np.asarray(t) * bounds[-1]
        index = np.clip(np.searchsorted(bounds, at, side="right") - 1, 0, len(segments) - 1)
        points = np.empty((len(at), 2))
        for k, (start, end, centre) in enumerate(segments):
            mine = index == k
            share = (at[mine] - bounds[k]) / lengths[k] if lengths[k] > 0 else np.zeros(mine.sum())
            points[mine] = _along(start, end, centre, share)
        return points

    return curve


def _along(start: FloatArray, end: FloatArray, centre: FloatArray | None, share: FloatArray) -> FloatArray:
    if centre is None:
        return start + (end - start) * share[:, None]
    a, b = start - centre, end - centre
    turn = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)
    cosine, sine = np.cos(turn * share), np.sin(turn * share)
    return centre + np.column_stack([cosine * a[0] - sine * a[1], sine * a[0] + cosine * a[1]])


def ruled(bottom: Curve, top: Curve, t: FloatArray, s: FloatArray) -> FloatArray:
    """Grid between two curves by straight lines, (len(t), len(s), 2).

    bottom, top : the curves; t : parameters along them; s : across, 0 to 1
    """
    return bottom(t)[:, None] * (1 - s)[None, :, None] + top(t)[:, None] * s[None, :, None]
