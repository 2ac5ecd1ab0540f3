"""Closed outlines in the x-z plane with rounded corners: the finger's silhouette and its chambers, in mm.

An outline is a polygon, counter-clockwise seen with x to the right and z up, with a radius at each corner.
Solids, drawing, bill and printability rules all start from the same two outlines.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, cos, pi, sin, tan

import numpy as np

from tubefoot.design.profile import FloatArray, Profile

CHORD_RAD = pi / 24
"""Largest turn between two points of a sampled arc [rad]."""


@dataclass(frozen=True)
class Arc:
    """Rounded corner: its start, middle and end, each (x, z) [mm]; a sharp one is a point."""

    start: FloatArray
    middle: FloatArray
    end: FloatArray

    @property
    def is_point(self) -> bool:
        """Whether the corner is sharp."""
        return bool(np.allclose(self.start, self.end, atol=1e-9))


@dataclass(frozen=True)
class Outline:
    """Polygon with rounded corners: corners (n, 2) as (x, z) [mm], radii (n,) [mm]."""

    corners: FloatArray
    radii: FloatArray

    def turns(self) -> FloatArray:
        """Signed turn at each corner [rad], (n,): positive where the outline is convex."""
        before = self.corners - np.roll(self.corners, 1, axis=0)
        after = np.roll(self.corners, -1, axis=0) - self.corners
        cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
        return np.arctan2(cross, np.einsum("ci,ci->c", before, after))

    def offset(self, distance: float) -> Outline:
        """The outline with every edge moved along its outer normal, fillets kept concentric.

        distance : how far [mm]; negative moves inwards
        """
        edge = np.roll(self.corners, -1, axis=0) - self.corners
        direction = edge / np.linalg.norm(edge, axis=1, keepdims=True)
        normal = np.column_stack([direction[:, 1], -direction[:, 0]])
        before = np.roll(normal, 1, axis=0)
        # The corner moves along the bisector of its two normals, farther the more it turns.
        mitre = (before + normal) / (1.0 + np.einsum("ci,ci->c", before, normal))[:, None]
        grown = self.radii + distance * np.sign(self.turns())
        radii = np.where(self.radii > 0, np.maximum(grown, 0.0), 0.0)
        return Outline(self.corners + distance * mitre, radii)

    def mirrored(self) -> Outline:
        """The outline on the other side of the centre line x = 0, still counter-clockwise."""
        return Outline((self.corners * [-1.0, 1.0])[::-1], self.radii[::-1])

    def rounded_corners(self) -> list[Arc]:
        """One arc for each corner, in order; straight lines join the end of one to the start of the next."""
        arcs = []
        n = len(self.corners)
        for i, (corner, radius, turn) in enumerate(zip(self.corners, self.radii, self.turns(), strict=True)):
            if radius <= 0 or abs(turn) < 1e-9:
                arcs.append(Arc(corner, corner, corner))
                continue
            back = _unit(self.corners[i - 1] - corner)
            ahead = _unit(self.corners[(i + 1) % n] - corner)
            setback = radius * tan(abs(turn) / 2)
            inwards = _unit(back + ahead)
            middle = corner + inwards * radius * (1 / cos(turn / 2) - 1)
            arcs.append(Arc(corner + setback * back, middle, corner + setback * ahead))
        return arcs

    def area(self) -> float:
        """Enclosed area, arcs exact [mm^2]."""
        x, z = self.corners.T
        polygon = 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))
        turn = self.turns()
        return polygon - float(
            np.sum(np.sign(turn) * self.radii**2 * (np.tan(abs(turn) / 2) - abs(turn) / 2))
        )

    def points(self) -> FloatArray:
        """The outline as a closed polygon, (n, 2), arcs cut into chords of at most `CHORD_RAD`."""
        parts = []
        for arc, radius, turn in zip(self.rounded_corners(), self.radii, self.turns(), strict=True):
            parts.append(arc.start[None] if arc.is_point else _arc_points(arc, radius, turn))
        return np.concatenate(parts)


def silhouette(profile: Profile) -> Outline:
    """The outside of the whole finger with its caps, both sides.

    profile : derived lengths of the finger
    """
    right = _along(profile, profile.outer_corners())
    low, high = -profile.cap, profile.bellows_length + profile.cap
    side = np.concatenate([[[profile.valley_outside, low]], right, [[profile.valley_outside, high]]])
    radii = np.concatenate([[0.0], np.full(len(right), profile.fillet_outside), [0.0]])
    left = side[::-1] * [-1.0, 1.0]
    return Outline(np.concatenate([side, left]), np.concatenate([radii, radii[::-1]]))


def chamber(profile: Profile) -> Outline:
    """The right chamber between partition and fold walls.

    profile : derived lengths of the finger
    """
    side = _along(profile, profile.chamber_corners())
    top = profile.bellows_length
    start = [[profile.partition_face, 0.0], [profile.valley_inside, 0.0]]
    end = [[profile.valley_inside, top], [profile.partition_face, top]]
    radii = np.concatenate([[0.0, 0.0], np.full(len(side), profile.fillet_chamber), [0.0, 0.0]])
    return Outline(np.concatenate([start, side, end]), radii)


def nearest(first: FloatArray, second: FloatArray) -> tuple[float, FloatArray]:
    """Shortest distance between two closed polygons that do not cross [mm], and its middle (x, z).

    first : (n, 2) corners
    second : (m, 2) corners
    """
    best, place = np.inf, np.zeros(2)
    for points, polygon in ((first, second), (second, first)):
        start, end = polygon, np.roll(polygon, -1, axis=0)
        along = end - start
        squared = np.maximum(np.einsum("si,si->s", along, along), 1e-30)
        for point in points:
            share = np.clip(np.einsum("si,si->s", point - start, along) / squared, 0.0, 1.0)
            foot = start + share[:, None] * along
            distance = np.linalg.norm(point - foot, axis=1)
            closest = int(np.argmin(distance))
            if distance[closest] < best:
                best, place = float(distance[closest]), (point + foot[closest]) / 2
    return best, place


def _along(profile: Profile, corners: FloatArray) -> FloatArray:
    """The corners of one unit repeated for all, (4 units, 2)."""
    steps = np.arange(profile.units) * profile.pitch
    return (corners[None] + steps[:, None, None] * np.array([0.0, 1.0])).reshape(-1, 2)


def _unit(vector: FloatArray) -> FloatArray:
    return vector / np.linalg.norm(vector)


def _arc_points(arc: Arc, radius: float, turn: float) -> FloatArray:
    chord = arc.end - arc.start
    heading = atan2(chord[1], chord[0]) - turn / 2
    steps = np.linspace(0.0, turn, max(2, int(np.ceil(abs(turn) / CHORD_RAD)) + 1))
    points = [arc.start]
    for before, after in pairwise(steps):
        length = 2 * radius * sin(abs(after - before) / 2)
        angle = heading + (before + after) / 2
        points.append(points[-1] + length * np.array([cos(angle), sin(angle)]))
    return np.array(points)
