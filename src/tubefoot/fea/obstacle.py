"""Contact of a wall with rigid bodies: planes, spheres, boxes with rounded edges; forces and moments on them.

Every quadrature point of the wall carries, per undeformed area, the barrier energy w(g) of `contact`, with g
its distance to the body's surface. The body is moved between steps by replacing `shape`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class RigidShape(Protocol):
    """The surface of a rigid body, by its signed distance, negative inside."""

    def distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance (n,) [mm], its gradient (n, 3), the outward normal, and its second derivative (n, 3, 3).

        points : (n, 3) [mm]
        """


@dataclass(frozen=True)
class Plane:
    """A half space.

    point : on its surface [mm]; normal : out of it, of any length
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]

    def distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance, gradient and second derivative, see `RigidShape`.

        points : (n, 3) [mm]
        """
        normal = np.asarray(self.normal, float) / np.linalg.norm(self.normal)
        n = len(points)
        return (points - self.point) @ normal, np.tile(normal, (n, 1)), np.zeros((n, 3, 3))


@dataclass(frozen=True)
class Sphere:
    """A ball.

    centre : [mm]; radius : [mm]
    """

    centre: tuple[float, float, float]
    radius: float

    def distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance, gradient and second derivative, see `RigidShape`.

        points : (n, 3) [mm]
        """
        away = points - np.asarray(self.centre, float)
        length = np.linalg.norm(away, axis=1)
        normal = away / length[:, None]
        flat = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        return length - self.radius, normal, flat / length[:, None, None]


@dataclass(frozen=True)
class Box:
    """A box with rounded edges.

    centre : [mm]; sizes : full edge lengths along its axes [mm]
    rounding : radius of its edges and corners [mm], above zero, so that its normal is continuous
    axes : (3, 3) rows, orthonormal directions of its edges
    """

    centre: tuple[float, float, float]
    sizes: tuple[float, float, float]
    rounding: float
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        if not 0.0 < self.rounding <= min(self.sizes) / 2:
            raise ConfigError(
                f"rounding = {self.rounding:g} mm must be above 0 and at most half the shortest edge "
                f"({min(self.sizes) / 2:g} mm)"
            )
        axes = np.asarray(self.axes, float)
        if axes.shape != (3, 3) or np.abs(axes @ axes.T - np.eye(3)).max() > 1e-9:
            raise ConfigError("axes of a box must be three orthonormal rows")

    def distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance, gradient and second derivative, see `RigidShape`.

        points : (n, 3) [mm]
        """
        axes = np.asarray(self.axes, float)
        local = (points - np.asarray(self.centre, float)) @ axes.T
        sign = np.where(local < 0, -1.0, 1.0)
        over = np.abs(local) - (np.asarray(self.sizes, float) / 2 - self.rounding)
        beyond = np.maximum(over, 0.0)
        length = np.linalg.norm(beyond, axis=1)
        outside = length > 0.0
        # Inside the core the nearest face counts; outside, the distance to the core.
        nearest = np.eye(3)[np.argmax(over, axis=1)]
        safe = np.where(outside, length, 1.0)
        normal = np.where(outside[:, None], beyond / safe[:, None], nearest)
        gap = np.where(outside, length, over.max(axis=1)) - self.rounding
        active = (over > 0.0).astype(float)
        flat = active[:, :, None] * np.eye(3) - normal[:, :, None] * normal[:, None, :]
        curved = np.where(outside[:, None, None], flat / safe[:, None, None], 0.0)
        curved = sign[:, :, None] * curved * sign[:, None, :]
        return gap, (sign * normal) @ axes, np.einsum("ai,nab,bj->nij", axes, curved, axes)


class Obstacle:
    """A rigid body before a wall; as an item it adds the barrier's energy.

    force : on the body at the last evaluation, (3,) [N]; moment : about the origin, (3,) [N mm]
    gaps : (n_samples,) distances at the last evaluation [mm]; places : (n_samples, 3) of the wall then [mm]
    pushes : (n_samples, 3) forces on the body then [N]; areas : (n_samples,) undeformed, of each [mm^2]
    """

    def __init__(self, mesh: Mesh, facets: str, shape: RigidShape, barrier: Barrier | None = None):
        """Prepare the samples.

        mesh : the mesh; facets : name of the wall's facet set; shape : the rigid body
        barrier : how wall and body repel each other
        """
        self.shape, self.barrier = shape, barrier or Barrier()
        wall = mesh.facet_set(facets)
        kind = element_kind(wall.kind)
        self._nodes, self._rest = wall.nodes, mesh.points
        self._shape = kind.shape(kind.quadrature_points)
        tangents = np.einsum(
            "qad,fai->fqdi", kind.shape_gradient(kind.quadrature_points), mesh.points[wall.nodes]
        )
        areas = np.linalg.norm(np.cross(tangents[..., 0, :], tangents[..., 1, :]), axis=-1)
        self._weights: FloatArray = areas * kind.quadrature_weights
        self.pattern: IntArray = (3 * wall.nodes[:, :, None] + np.arange(3)).reshape(len(wall.nodes), -1)
        self.areas: FloatArray = self._weights.ravel()
        self.gaps = np.full(self._weights.size, np.inf)
        self.places, self.pushes = np.zeros((2, self._weights.size, 3))
        self.force, self.moment = np.zeros(3), np.zeros(3)

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the contact forces and their stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy, magnitude, smallest gap
        """
        n_facets, size = self.pattern.shape
        positions = (self._rest + state.unknowns[: self._rest.size].reshape(-1, 3))[self._nodes]
        points = np.einsum("qa,fai->fqi", self._shape, positions).reshape(-1, 3)
        gaps, normals, curved = self.shape.distance(points)
        self.gaps, self.places = gaps, points
        reach, stiffness = self.barrier.reach, self.barrier.stiffness
        excess = np.maximum(0.0, reach - gaps)
        weights = self._weights.ravel()
        first = -weights * stiffness / reach * excess**2
        second = 2.0 * weights * stiffness / reach * excess
        on_body = self.pushes = first[:, None] * normals
        self.force, self.moment = on_body.sum(axis=0), np.cross(points, on_body).sum(axis=0)
        split = on_body.reshape(n_facets, -1, 3)
        residuals = np.einsum("qa,fqi->fai", self._shape, split).reshape(n_facets, size)
        matrices = np.zeros((n_facets, size, size))
        touched = np.flatnonzero((excess > 0.0).reshape(n_facets, -1).any(axis=1))
        if sink.stiff and len(touched):
            blocks = second[:, None, None] * normals[:, :, None] * normals[:, None, :]
            blocks += first[:, None, None] * curved
            blocks = blocks.reshape(n_facets, -1, 3, 3)[touched]
            full = np.einsum("qa,fqij,qb->faibj", self._shape, blocks, self._shape, optimize=True)
            matrices[touched] = full.reshape(len(touched), size, size)
        found.energy += float((weights * stiffness / (3 * reach) * excess**3).sum())
        if gaps.min() < self.barrier.ahead:
            found.min_gap = min(found.min_gap, float(gaps.min()))
        found.magnitude = max(found.magnitude, float(np.abs(residuals).max(initial=0.0)))
        sink.add(self, 0, matrices, residuals)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """


def mirror_image(mesh: Mesh, facets: str, barrier: Barrier) -> Obstacle:
    """What holds a wall off its mirror image beyond the plane of symmetry y = 0: a rigid plane there.

    Both walls stand y off the plane and 2 y from each other. Half of the energy w(2 y) that they have in
    common is the wall's own: that of a plane with half the reach and twice the stiffness.

    mesh : the half y >= 0; facets : name of the wall's facet set, off the plane
    barrier : how wall and image repel each other; the reach is cut to half their distance at rest
    """
    wall = mesh.facet_set(facets)
    between = 2.0 * float(mesh.points[np.unique(wall.nodes), 1].min())
    reach = min(barrier.reach, between / 2)
    plane = Plane((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    return Obstacle(mesh, facets, plane, replace(barrier, reach=reach / 2, stiffness=2 * barrier.stiffness))
