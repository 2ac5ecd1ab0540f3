"""Centreline: the finger's middle line in the bending plane, from markers at known heights.

The line is described by its curvature kappa(s) over the height s of the straight finger, zero in the rigid
end caps:

    psi' = kappa,   x' = -(1 + e) sin psi,   z' = (1 + e) cos psi,

with one mean stretch e. Of all such lines the fit takes the one that agrees with places and directions of
the markers and whose curvature changes least abruptly: kappa'' is white noise of small strength, a cubic
smoothing spline. The base is clamped. psi is positive towards -x, as the bending angle. The fit is linear
in kappa but for psi inside sine and cosine, and is solved by Gauss-Newton; its covariance gives the
uncertainty of every derived angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from tubefoot.units import DEG
from tubefoot.vision.lens import FloatArray

INTERVALS = 24
CURVATURE_STRENGTH = 1e-9
"""Spectral density of kappa'' [1/mm^5]; contact kinks the curvature by some 2e-4 /mm^2 in 40 mm."""

CURVATURE_SCALE = 0.05
"""Loose prior on the mean curvature of the lower half [1/mm]."""

TIP_SLOPE_SIGMA = 3e-5
"""Slope of the curvature at the tip [1/mm^2]: nothing pushes on the free end, so it is even there."""

BASE_SIGMA = 0.05 * DEG
BASE_PLACE_SIGMA = 0.03
STRETCH_SIGMA = 0.05
ANGLE_FLOOR = 0.01 * DEG
PLACE_FLOOR = 0.01
"""What a marker's own uncertainty does not hold: how well it sits at its height [rad, mm]."""

THETA_SIGMA_LIMIT = 1.0 * DEG
"""A half whose turn is less certain than this is not reported [rad]."""

LEAST_LOBE = 1.0 * DEG
"""A stretch of opposite curvature that turns by less is no inflexion [rad]."""


@dataclass(frozen=True)
class MarkedPoint:
    """A marker as a point of the centreline.

    height : its place on the straight finger [mm]
    x, z : where it is [mm]
    angle : direction of the centreline there [rad]
    place_sigma : standard uncertainty of x and z [mm]
    angle_sigma : standard uncertainty of the angle [rad]
    """

    height: float
    x: float
    z: float
    angle: float
    place_sigma: float = 0.0
    angle_sigma: float = 0.0


@dataclass(frozen=True)
class Centreline:
    """A fitted centreline, sampled from base to tip.

    height : (n,) place on the straight finger [mm]
    points : (n, 2) x, z [mm]
    angle : (n,) direction against straight [rad]
    curvature : (n,) change of direction along the straight finger [rad/mm]
    thetas : turn over the lower and the upper half [rad]; NaN where it is not determined
    theta_sigma : their standard uncertainties [rad]
    inflexions : heights at which the curvature changes sign [mm]
    """

    height: FloatArray
    points: FloatArray
    angle: FloatArray
    curvature: FloatArray
    thetas: tuple[float, float]
    theta_sigma: tuple[float, float]
    inflexions: tuple[float, ...]


def fit_centreline(
    points: Sequence[MarkedPoint], length: float, rigid_base: float = 0.0, rigid_tip: float = 0.0
) -> Centreline | None:
    """The centreline through at least two markers, None when there are fewer.

    points : markers that were seen
    length : finger from base to tip [mm]
    rigid_base : length at the base that does not bend [mm]
    rigid_tip : length at the tip that does not bend [mm]
    """
    if len(points) < 2:
        return None
    rod = _find_rod(length, rigid_base, rigid_tip)
    unknowns = np.zeros(rod.size)
    unknowns[:-4] = points[-1].angle / max(points[-1].height, length / 4)
    for _ in range(8):
        rows, misfit = rod.equations(unknowns, points)
        step = np.linalg.solve(rows.T @ rows, rows.T @ misfit)
        unknowns = unknowns + step
        if np.max(np.abs(rod.turning @ step[: rod.turning.shape[1]])) < 1e-6:
            break
    rows, _ = rod.equations(unknowns, points)
    covariance = np.asarray(np.linalg.inv(rows.T @ rows), dtype=float)
    return rod.centreline(unknowns, covariance)


def chord_angles(points: Sequence[MarkedPoint], length: float, marker_side: float) -> tuple[float, float]:
    """Turns [rad] of the chords between midpoints of the markers' lower edges, NaN when markers are missing.

    The first is from the lowest chord to the one across the middle of the finger, the second from there to
    the uppermost chord. Chords turn less than tangents: each stands for the mean direction between two
    markers.

    points : markers that were seen, from base to tip
    length : finger from base to tip [mm]
    marker_side : side of a marker [mm]
    """
    below = [index for index, point in enumerate(points) if point.height - marker_side / 2 <= length / 2]
    middle = below[-1] if below else -1
    if middle < 1 or middle + 2 >= len(points):
        return float("nan"), float("nan")
    down = marker_side / 2
    edge = np.array([[p.x + down * np.sin(p.angle), p.z - down * np.cos(p.angle)] for p in points])
    chords = np.diff(edge, axis=0)
    direction = np.unwrap(np.arctan2(-chords[:, 0], chords[:, 1]))
    return float(direction[middle] - direction[0]), float(direction[-1] - direction[middle])


class _Rod:
    """Unknowns: curvature at the nodes that bend, then base angle, base x and z, stretch."""

    def __init__(self, length: float, rigid_base: float, rigid_tip: float):
        self.length = length
        flexible = np.linspace(rigid_base, length - rigid_tip, INTERVALS + 1)
        self.pitch = float(flexible[1] - flexible[0])
        self.height = np.concatenate([[0.0], flexible, [length]])
        self.steps = np.diff(self.height)
        count = flexible.size
        self.size = count + 4
        means = (np.eye(count)[1:] + np.eye(count)[:-1]) / 2
        turns = np.vstack([np.zeros(count), np.cumsum(means * self.pitch, axis=0)])
        self.turning = np.vstack([turns[0], turns, turns[-1]])
        self.integral = self._integration()
        self._prior = self._prior_rows()
        self._weights: dict[float, FloatArray] = {}

    def _prior_rows(self) -> FloatArray:
        count = self.turning.shape[1]
        rows = np.zeros((count + 4, self.size))
        rows[: count - 2, :count] = np.diff(np.eye(count), 2, axis=0) / np.sqrt(
            CURVATURE_STRENGTH * self.pitch**3
        )
        rows[count - 2, : count // 2] = 1 / CURVATURE_SCALE / (count // 2)
        rows[count - 1, [count - 4, count - 1]] = np.array([-1.0, 1.0]) / (TIP_SLOPE_SIGMA * 3 * self.pitch)
        sigmas = (BASE_SIGMA, BASE_PLACE_SIGMA, BASE_PLACE_SIGMA, STRETCH_SIGMA)
        rows[count:, count:] = np.diag(1 / np.array(sigmas))
        return rows

    def shape(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Direction (n,) and places (n, 2) of the line."""
        count = self.turning.shape[1]
        angle = unknowns[count] + self.turning @ unknowns[:count]
        stretch = 1 + unknowns[count + 3]
        places = np.column_stack([-self.integral @ np.sin(angle), self.integral @ np.cos(angle)])
        return angle, places * stretch + unknowns[count + 1 : count + 3]

    def _integration(self) -> FloatArray:
        """Rows (n, n) that integrate nodal values from the base: trapezes, corrected by end slopes."""
        nodes = np.eye(self.height.size)
        pieces = (nodes[1:] + nodes[:-1]) / 2
        slope = np.gradient(nodes[1:-1], self.pitch, axis=0, edge_order=2)
        pieces[1:-1] -= (slope[1:] - slope[:-1]) * self.pitch / 12
        areas = pieces * self.steps[:, None]
        return np.vstack([np.zeros(self.height.size), np.cumsum(areas, axis=0)])

    def equations(self, unknowns: FloatArray, points: Sequence[MarkedPoint]) -> tuple[FloatArray, FloatArray]:
        """Weighted rows and right-hand sides of one Gauss-Newton step."""
        count = self.turning.shape[1]
        angle, places = self.shape(unknowns)
        stretch = 1 + unknowns[count + 3]
        turn = np.column_stack([self.turning, np.ones(len(angle)), np.zeros((len(angle), 3))])
        move_x = -stretch * (self.integral @ (np.cos(angle)[:, None] * turn))
        move_z = -stretch * (self.integral @ (np.sin(angle)[:, None] * turn))
        move_x[:, count + 1] = 1.0
        move_z[:, count + 2] = 1.0
        move_x[:, count + 3] = (places[:, 0] - unknowns[count + 1]) / stretch
        move_z[:, count + 3] = (places[:, 1] - unknowns[count + 2]) / stretch
        rows, misfits = [self._prior], [-self._prior @ unknowns]
        for point in points:
            angle_weight = 1 / np.hypot(point.angle_sigma, ANGLE_FLOOR)
            place_weight = 1 / np.hypot(point.place_sigma, PLACE_FLOOR)
            at = self.weights(point.height)
            wanted = (
                (turn, angle, point.angle, angle_weight),
                (move_x, places[:, 0], point.x, place_weight),
                (move_z, places[:, 1], point.z, place_weight),
            )
            for slopes, values, seen, weight in wanted:
                rows.append((at @ slopes * weight)[None])
                misfits.append(np.array([(seen - at @ values) * weight]))
        return np.vstack(rows), np.concatenate(misfits)

    def weights(self, height: float) -> FloatArray:
        """Weights (n,) of the nodes for a value at a height, worked out once."""
        if height not in self._weights:
            self._weights[height] = self._interpolation(height)
        return self._weights[height]

    def _interpolation(self, height: float) -> FloatArray:
        """Weights (n,) of the nodes for a value at a height: cubic where it bends, straight elsewhere."""
        weights = np.zeros(self.height.size)
        place = (height - self.height[1]) / self.pitch
        if place < 0 or self.steps[0] == height == 0:
            share = height / self.steps[0] if self.steps[0] > 0 else 1.0
            weights[:2] = (1 - share, share)
        elif place > INTERVALS:
            share = (height - self.height[-2]) / self.steps[-1] if self.steps[-1] > 0 else 0.0
            weights[-2:] = (1 - share, share)
        else:
            nodes = int(np.clip(np.floor(place) - 1, 0, INTERVALS - 3)) + np.arange(4)
            for node in nodes:
                others = nodes[nodes != node]
                weights[node + 1] = np.prod((place - others) / (node - others))
        return weights

    def centreline(self, unknowns: FloatArray, covariance: FloatArray) -> Centreline:
        """The line and its derived angles."""
        count = self.turning.shape[1]
        angle, places = self.shape(unknowns)
        half = self.weights(self.length / 2) @ self.turning
        lower = np.concatenate([half, np.zeros(4)])
        upper = np.concatenate([self.turning[-1] - half, np.zeros(4)])
        sigmas = [float(np.sqrt(part @ covariance @ part)) for part in (lower, upper)]
        turns = [float(part @ unknowns) for part in (lower, upper)]
        known = [
            turn if sigma <= THETA_SIGMA_LIMIT else float("nan")
            for turn, sigma in zip(turns, sigmas, strict=True)
        ]
        curvature = np.concatenate([[0.0], unknowns[:count], [0.0]])
        return Centreline(
            height=self.height,
            points=places,
            angle=angle,
            curvature=curvature,
            thetas=(known[0], known[1]),
            theta_sigma=(sigmas[0], sigmas[1]),
            inflexions=find_inflexions(self.height, curvature),
        )


@lru_cache(maxsize=16)
def _find_rod(length: float, rigid_base: float, rigid_tip: float) -> _Rod:
    return _Rod(length, rigid_base, rigid_tip)


def find_inflexions(height: FloatArray, curvature: FloatArray) -> tuple[float, ...]:
    """Heights [mm] at which the curvature changes sign between stretches that turn by a degree at least.

    height : (n,) ascending places [mm]
    curvature : (n,) [rad/mm]
    """
    steps = (curvature[1:] + curvature[:-1]) / 2 * np.diff(height)
    lobes: list[tuple[float, float]] = []
    start = 0
    for index in range(1, len(steps) + 1):
        if index == len(steps) or np.sign(steps[index]) != np.sign(steps[start]):
            turn = float(np.sum(steps[start:index]))
            if abs(turn) >= LEAST_LOBE:
                lobes.append((float(height[start]), turn))
            start = index
    return tuple(after[0] for before, after in pairwise(lobes) if before[1] * after[1] < 0)
