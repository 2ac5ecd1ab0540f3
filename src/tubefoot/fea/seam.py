"""The bonded mid-plane y = 0 under load: tractions, opening force and peeling moment of the seam.

Two independent readings. The stress field at the facets gives the tractions S33 (across the bond), S13 and
S23 (along it); its peaks at re-entrant edges depend on the mesh, its percentiles by area hardly. The
reactions of the symmetry plane give forces: what the other half pulls with. They balance the fluid exactly,

    sum of forces on mid-plane and base along y = sum over chambers of pressure x opening in the mid-plane.

Positive opens the bond. On the ideal symmetric finger S13 and S23 vanish here; a resin film puts them back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.fea.elements import ElementKind, element_kind, gauss_line
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.measures import PAPER_AXES, RIGID_REGIONS, percentile
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import Solid
from tubefoot.units import KPA

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Row = dict[str, Any]

ON_AXIS_MM = 1e-9


@dataclass(frozen=True)
class FaceCells:
    """Facets of a set as faces of their cells.

    cell, face : (n,) number of the cell and of its face; nodes : (n, n_face_nodes) in the cell's order
    """

    cell: IntArray
    face: IntArray
    nodes: IntArray

    @classmethod
    def of(cls, mesh: Mesh, solid: Solid, facets: str) -> FaceCells:
        """The cells behind a facet set.

        mesh : the mesh; solid : whose cells are looked at; facets : name of the set

        Raises ConfigError when a facet belongs to none of them.
        """
        wanted = mesh.facet_set(facets)
        corners = element_kind(wanted.kind).n_corners
        faces = np.array(solid.kind.faces)
        nodes = solid.block.nodes[:, faces]
        known = {
            tuple(row): number
            for number, row in enumerate(np.sort(nodes[..., :corners].reshape(-1, corners), axis=1).tolist())
        }
        try:
            found = np.array(
                [known[tuple(row)] for row in np.sort(wanted.nodes[:, :corners], axis=1).tolist()]
            )
        except KeyError:
            raise ConfigError(f"a facet of `{facets}` is no face of a solid cell") from None
        cell, face = np.divmod(found, len(faces))
        return cls(cell, face, nodes[cell, face])

    def chosen(self, mask: NDArray[np.bool_]) -> FaceCells:
        """Some of the facets.

        mask : (n,) which
        """
        return FaceCells(self.cell[mask], self.face[mask], self.nodes[mask])


@dataclass(frozen=True)
class SeamState:
    """What the bond bears in one state.

    traction : component to its values at the facets' quadrature points, (n_facets, n_q) [MPa]
    reaction : (n_points,) opening force of each point of the seam, as in `Seam.points` [N]
    """

    traction: dict[str, FloatArray]
    reaction: FloatArray


class Seam:
    """The mid-plane of a half finger's soft body; points on the base or on rigid parts belong to those."""

    def __init__(self, mesh: Mesh, solid: Solid):
        """Find its facets and points.

        mesh : of a half finger, with the facet sets `mid_plane` and `base`; solid : its cells
        """
        self.mesh, self.solid = mesh, solid
        faces = FaceCells.of(mesh, solid, "mid_plane")
        region = np.array(mesh.regions)[solid.block.region[faces.cell]]
        bonded = ~np.isin(region, RIGID_REGIONS)
        self._faces, self.region = faces.chosen(bonded), region[bonded]
        kind = element_kind(solid.kind.face_kind)
        self._kind = kind
        held = np.union1d(faces.nodes[~bonded], mesh.facet_set("base").points)
        self.points = np.setdiff1d(self._faces.nodes, held)
        shape = kind.shape(kind.quadrature_points)
        self.places = np.einsum("qa,fai->fqi", shape, mesh.points[self._faces.nodes])
        self.weights = self.areas(mesh.points)
        places, part_weights, self._spread = _force_rule(kind)
        self._parts = self.areas(mesh.points, places, part_weights)
        self.force_places = np.einsum("qa,fai->fqi", kind.shape(places), mesh.points[self._faces.nodes])
        shares = self._parts @ self._spread
        self._point_areas = np.bincount(self._faces.nodes.ravel(), shares.ravel(), minlength=len(mesh.points))

    def areas(
        self, positions: FloatArray, places: FloatArray | None = None, weights: FloatArray | None = None
    ) -> FloatArray:
        """Area that falls to each place of each facet, (n_facets, n_q) [mm^2].

        positions : (n_points, 3) of the mesh's points [mm]
        places, weights : reference coordinates and weights; the quadrature points if not given
        """
        places = self._kind.quadrature_points if places is None else places
        weights = self._kind.quadrature_weights if weights is None else weights
        slopes = self._kind.shape_gradient(places)
        tangents = np.einsum("qas,fai->fqsi", slopes, positions[self._faces.nodes])
        size = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=-1)
        return np.asarray(size * weights, float)

    def read(self, model: Model, state: State) -> SeamState:
        """The tractions and reactions in a state.

        model : the half finger with its fluids; state : an equilibrium of it
        """
        traction = {name: np.empty(self.weights.shape) for name in PAPER_AXES}
        reference = self.solid.kind.nodes[np.array(self.solid.kind.faces)]
        shape = self._kind.shape(self._kind.quadrature_points)
        for face in np.unique(self._faces.face):
            mine = self._faces.face == face
            cauchy = self.solid.stresses_at(state, self._faces.cell[mine], shape @ reference[face])
            for name, (row, column) in PAPER_AXES.items():
                traction[name][mine] = cauchy[..., row, column]
        return SeamState(traction, -support_forces(model, state)[self.points, 1])

    def pull(self, found: SeamState) -> FloatArray:
        """Opening force that falls to each place of `force_places`, (n_facets, n) [N]; sums to the reactions.

        found : of `read`
        """
        traction = np.zeros(len(self.mesh.points))
        traction[self.points] = found.reaction / self._point_areas[self.points]
        return (
            np.asarray(np.einsum("qa,fa->fq", self._spread, traction[self._faces.nodes]), float) * self._parts
        )


def _force_rule(kind: ElementKind) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places on a facet, their weights, and how a traction at the nodes spreads to them (n, n_nodes).

    Quadrilaterals: in four quarters, so that a facet over the centre line is cut there; with its own shape
    functions a traction that is linear between the nodes comes back from its nodal forces. Triangles, whose
    corners get no nodal force from an even traction: linear in the four parts between corners and mid-nodes.
    """
    if kind.name != "triangle6":
        line, weight = gauss_line(3)
        half = np.r_[line - 1, line + 1] / 2
        places = np.array([(s, t) for s in half for t in half])
        weights = np.outer(np.r_[weight, weight] / 2, np.r_[weight, weight] / 2).ravel()
        return places, weights, kind.shape(places)
    parts = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    linear = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
    spread = np.zeros((12, 6))
    for number, corners in enumerate(parts):
        spread[3 * number : 3 * number + 3, corners] = linear
    return spread @ kind.nodes, np.full(12, 0.5 / 12), spread


def support_forces(model: Model, state: State) -> FloatArray:
    """Force that its supports exert on each point, (n_points, 3) [N]; zero where nothing holds it.

    The residual is that force but on the rim of a cavity that a plane of symmetry closes: there the volume
    formula takes the rim to stay in the plane, so its derivative is not the fluid's push across it.

    model : what is in equilibrium; state : where
    """
    model.evaluate(state, stiff=False)
    n = model.mesh.points.size
    forces = model.system.residual[:n].reshape(-1, 3).copy()
    positions = model.mesh.points + state.unknowns[:n].reshape(-1, 3)
    for cavity in model.cavities:
        push = _wall_areas(model.mesh, cavity.name, positions)
        change = cavity.gradient(n).reshape(-1, 3) - push
        forces += state.pressures[cavity.number] * change
    return forces


def _wall_areas(mesh: Mesh, wall: str, positions: FloatArray) -> FloatArray:
    """Area vector of a cavity's wall that falls to each point, out of the fluid, (n_points, 3) [mm^2]."""
    facets = mesh.facet_set(wall)
    kind = element_kind(facets.kind)
    slopes = kind.shape_gradient(kind.quadrature_points)
    tangents = np.einsum("qas,fai->fqsi", slopes, positions[facets.nodes], optimize=True)
    # Facet normals point out of the solid, so into the fluid.
    area = -np.cross(tangents[:, :, 0], tangents[:, :, 1]) * kind.quadrature_weights[:, None]
    shares = np.einsum("qa,fqi->fai", kind.shape(kind.quadrature_points), area)
    found = np.zeros_like(positions)
    np.add.at(found, facets.nodes, shares)
    return found


def hand_weights(x: FloatArray, hand: str) -> FloatArray:
    """Share of each point that counts to one side: 1 on it, one half on the centre line.

    x : (n,) places across the finger [mm]; hand : right or left
    """
    side = x if hand == "right" else -x
    return np.where(np.abs(x) < ON_AXIS_MM, 0.5, (side > 0).astype(float))


def seam_rows(number: int, seam: Seam, found: SeamState, bond_strength: float | None) -> list[Row]:
    """Rows of seam.csv: the whole seam, each side, each region.

    Forces are those on the mid-plane of the whole finger. The peeling moment is that of a side's opening
    forces about its outer edge, at rest; positive opens the bond from the partition outwards. The margin is
    the bond strength over the 99th percentile of S33, empty without a strength or where nothing pulls.

    number : the state's step; seam : the mid-plane; found : of `Seam.read`
    bond_strength : tensile strength [MPa], if known
    """
    across = seam.places[..., 0]
    edge = float(np.abs(seam.mesh.points[seam.points, 0]).max())
    pull, beside = seam.pull(found), seam.force_places[..., 0]
    everywhere = np.ones(len(seam.region), dtype=bool)
    rows = [_row(number, "all", seam, found, everywhere, seam.weights, bond_strength)]
    rows[0]["opening_force_n"] = float(pull.sum())
    for hand in ("right", "left"):
        weights = seam.weights * hand_weights(across, hand)
        row = _row(number, hand, seam, found, everywhere, weights, bond_strength)
        mine = hand_weights(beside, hand) * pull
        row["opening_force_n"] = float(mine.sum())
        row["peeling_moment_n_mm"] = float((mine * (edge - np.abs(beside))).sum())
        rows.append(row)
    for name in np.unique(seam.region):
        mask = seam.region == name
        row = _row(number, str(name), seam, found, mask, seam.weights, bond_strength)
        row["opening_force_n"] = float(pull[mask].sum())
        rows.append(row)
    return rows


def _row(
    number: int,
    place: str,
    seam: Seam,
    found: SeamState,
    mask: NDArray[np.bool_],
    weights: FloatArray,
    bond_strength: float | None,
) -> Row:
    area = weights[mask]
    s33 = found.traction["s33"][mask]
    counted = s33[area > 0]
    p99 = percentile(s33, area, 0.99)
    strength = bond_strength if bond_strength is not None and p99 > 0 else None
    return {
        "step": number,
        "place": place,
        "area_mm2": float(area.sum()),
        "opening_force_n": None,
        "peeling_moment_n_mm": None,
        "s33_p99_kpa": p99 / KPA,
        "s33_max_kpa": float(counted.max()) / KPA,
        "s33_min_kpa": float(counted.min()) / KPA,
        "s33_mean_kpa": float((s33 * area).sum() / area.sum()) / KPA,
        "s13_p99_kpa": percentile(np.abs(found.traction["s13"][mask]), area, 0.99) / KPA,
        "s23_p99_kpa": percentile(np.abs(found.traction["s23"][mask]), area, 0.99) / KPA,
        "bond_margin": strength / p99 if strength is not None else None,
    }
