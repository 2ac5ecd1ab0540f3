"""The mesh of a grasped object: box, ellipsoid or cylinder, of 27-node hexahedra.

The object is centred at the origin; only x >= 0 and y >= 0 is meshed, the part that one finger of a symmetric
grasp touches on its half. Round objects are a cube in the middle with shells around it, so that no cell has
an edge of 180 degrees; along an axis that is not round they are swept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.fea.elements import element_kind
from tubefoot.fea.mesh import CellBlock, FacetSet, Mesh, require_quality

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CORE = 0.5
"""Half edge of the cube in the middle over the radius."""
REGION = "object"
"""Name of the object's region; its facet sets begin with it too."""
LOWEST = (0.0, 0.0, -1.0)
"""Where the modelled part begins along x, y, z, in half sizes."""


def object_mesh(
    sizes: Sequence[float], round_axes: Sequence[int], element_size: float, edge_radius: float = 1.0
) -> Mesh:
    """The part x >= 0, y >= 0 of an object, in the region `object`.

    Facet sets: object_skin, object_middle (x = 0) and object_cut (y = 0).

    sizes : full sizes along x, y, z [mm]
    round_axes : axes of its round section: none for a box, (0, 1, 2) for an ellipsoid, two for a cylinder
    element_size : longest edge of a cell, about [mm]
    edge_radius : of a box's edges along y, which a bent finger would press first [mm]

    Raises ConfigError for sizes that are not positive, GeometryError when a cell is too distorted.
    """
    half = np.asarray(sizes, float) / 2.0
    if half.shape != (3,) or not (half > 0.0).all() or element_size <= 0.0:
        raise ConfigError(f"object sizes {tuple(sizes)} mm and element size {element_size:g} mm must be > 0")
    if not round_axes and not 0.0 < edge_radius <= 0.9 * min(half[0], half[2]):
        raise ConfigError(
            f"edge radius {edge_radius:g} mm of a box {tuple(sizes)} mm must be above 0 and at most "
            f"{0.9 * min(half[0], half[2]):g} mm"
        )
    section = _Section(half, tuple(sorted(round_axes)), edge_radius)
    patches = [_lattice(section.counts(None, element_size), section.core)]
    for axis, sign in section.shells:
        counts = section.counts(axis, element_size)
        patches.append(_lattice(counts, partial(section.shell, radial=axis, sign=sign, counts=counts)))
    points, nodes = _joined(patches)
    block = CellBlock("hexahedron27", nodes, np.zeros(len(nodes), dtype=np.int64))
    mesh = Mesh(points, (block,), (REGION,), _facets(points, block))
    require_quality(mesh)
    return mesh


def beside(mesh: Mesh, other: Mesh, shift: Sequence[float] | FloatArray) -> Mesh:
    """One mesh of two bodies with cells of the same kind; names of regions and facet sets are kept.

    mesh, other : the bodies, with one block each; shift : by which the other is moved [mm]

    Raises ConfigError when their cells or names do not go together.
    """
    first, second = mesh.blocks[0], other.blocks[0]
    shared = set(mesh.regions) & set(other.regions) | set(mesh.facets) & set(other.facets)
    if len(mesh.blocks) != 1 or len(other.blocks) != 1 or first.kind != second.kind or shared:
        raise ConfigError("two bodies make one mesh when their cells are of one kind and no name is shared")
    start = len(mesh.points)
    block = replace(
        first,
        nodes=np.vstack([first.nodes, second.nodes + start]),
        region=np.r_[first.region, second.region + len(mesh.regions)],
    )
    facets = {name: replace(found, nodes=found.nodes + start) for name, found in other.facets.items()}
    points = np.vstack([mesh.points, other.points + np.asarray(shift, float)])
    return Mesh(points, (block,), (*mesh.regions, *other.regions), {**mesh.facets, **facets})


def _lattice(
    counts: tuple[int, int, int], mapping: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, IntArray]:
    """Points and 27-node cells of a block; the mapping takes points (n, 3) of the unit cube."""
    shape = 2 * np.array(counts) + 1
    grid = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, n) for n in shape), indexing="ij"), axis=-1)
    corners = 2 * np.array(list(product(*(range(n) for n in counts))))
    within = np.round(element_kind("hexahedron27").nodes + 1.0).astype(int)
    nodes = np.ravel_multi_index((corners[:, None] + within).transpose(2, 0, 1), tuple(shape))
    return mapping(grid.reshape(-1, 3)), np.asarray(nodes, np.int64)


class _Section:
    """How the unit cube is mapped to the middle of an object and to the shells around it."""

    def __init__(self, half: FloatArray, round_axes: tuple[int, ...], edge_radius: float):
        self.half, self.radius = half, edge_radius
        self.box = not round_axes
        self.axes = [0, 2] if self.box else list(round_axes)
        self.shells = [(axis, 1.0) for axis in self.axes] + ([(2, -1.0)] if 2 in self.axes else [])

    def counts(self, radial: int | None, element_size: float) -> tuple[int, int, int]:
        """Cells along x, y, z of the middle (no radial axis) or of a shell."""
        found = []
        for axis in range(3):
            length, ends = self.half[axis] * (1.0 - LOWEST[axis]), 1 - int(LOWEST[axis])
            least = ends
            if axis == radial:
                length, least = (1.0 - CORE) * self.half[self.axes].max(), 1
            elif axis in self.axes and self.box:
                length, least = length - ends * self.radius, least + ends  # its ends are the rounded edges
            elif axis in self.axes:
                length *= pi / 4  # 45 degrees on either side of the radial axis
            more = ends if self.box and axis in self.axes and axis != radial else 0
            found.append(max(least, more + ceil(length / element_size - 1e-9)))
        return found[0], found[1], found[2]

    def core(self, u: FloatArray) -> FloatArray:
        """Places in the middle."""
        found = self._spread(u)
        found[:, self.axes] *= CORE
        return found * self.half

    def shell(self, u: FloatArray, radial: int, sign: float, counts: tuple[int, int, int]) -> FloatArray:
        """Places between the middle's face across `radial` and the surface."""
        inner = self._spread(u)
        inner[:, radial] = sign
        depth = (u[:, radial] if sign > 0 else 1.0 - u[:, radial])[:, None]
        outer = self._rounded(inner, radial, counts) if self.box else self._ball(inner)
        inner[:, self.axes] *= CORE
        inner = inner * self.half
        return inner + depth * (outer - inner)

    def _spread(self, u: FloatArray) -> FloatArray:
        """From the unit cube to half sizes along each axis; round ones in equal angles."""
        low = np.array(LOWEST)
        spread = low + (1.0 - low) * u
        if not self.box:
            spread[:, self.axes] = np.tan(pi / 4 * spread[:, self.axes])
        return spread

    def _ball(self, direction: FloatArray) -> FloatArray:
        found = direction.copy()
        found[:, self.axes] /= np.linalg.norm(direction[:, self.axes], axis=1)[:, None]
        return found * self.half

    def _rounded(self, direction: FloatArray, radial: int, counts: tuple[int, int, int]) -> FloatArray:
        """On the face across `radial`, with half an edge's arc in the cells at its ends."""
        (along,) = (axis for axis in self.axes if axis != radial)
        found = direction * self.half
        share = (1.0 - LOWEST[along]) / counts[along]
        place = np.abs(direction[:, along])
        turn = np.maximum(0.0, (place - (1.0 - share)) / share) * pi / 4
        flat = (self.half[along] - self.radius) * np.minimum(1.0, place / (1.0 - share))
        found[:, along] = np.sign(direction[:, along]) * (flat + self.radius * np.sin(turn))
        inset = self.half[radial] - self.radius + self.radius * np.cos(turn)
        found[:, radial] = np.sign(direction[:, radial]) * inset
        return found


def _joined(patches: Sequence[tuple[FloatArray, IntArray]]) -> tuple[FloatArray, IntArray]:
    """Points and cells of blocks that meet point by point."""
    starts = np.cumsum([0, *(len(points) for points, _ in patches)])
    stacked = np.vstack([points for points, _ in patches])
    keys = np.round(stacked, 9) + 0.0
    _, first, merged = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    nodes = [merged.ravel()[cells + start] for (_, cells), start in zip(patches, starts[:-1], strict=True)]
    return stacked[first], np.vstack(nodes)


def _facets(points: FloatArray, block: CellBlock) -> dict[str, FacetSet]:
    """Outer faces by where they lie."""
    faces = np.array(block.element.faces)
    nodes = block.nodes[:, faces].reshape(-1, faces.shape[1])
    _, first, count = np.unique(nodes[:, 8], return_index=True, return_counts=True)
    outer = nodes[first[count == 1]]
    flat = [np.abs(points[outer][..., axis]).max(axis=1) < 1e-9 for axis in (0, 1)]
    sets = {"middle": outer[flat[0]], "cut": outer[flat[1]], "skin": outer[~flat[0] & ~flat[1]]}
    return {f"{REGION}_{name}": FacetSet("quad9", found) for name, found in sets.items()}
