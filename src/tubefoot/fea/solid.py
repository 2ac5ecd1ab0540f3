"""The hyperelastic solid as an item: cells of one block with their materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError
from tubefoot.fea.elements import PressureSpace
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.kernel import assemble_cells, point_stresses, recover_cells
from tubefoot.fea.mesh import CellBlock, Mesh, jacobian_at
from tubefoot.fea.strains import add_strains, replace_wild_strains

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLACK_STIFFNESS = 0.3
"""Share of the bulk modulus, in shear moduli, that acts on J itself and not through the pressure field.

Volume changes that a pressure space cannot see cost nothing in the isochoric energy, and at sharp re-entrant
edges cells use them. This share gives them a stiffness, and keeps J positive; the exact solution stays the
same, since the pressure field carries the rest of the bulk modulus.
"""

GUARD_FROM = 20.0
"""Bulk over shear modulus from which J is guarded by g / 4 (J - 1)^4, g = kappa - 20 mu.

In a nearly incompressible solid J - 1 is about mu / kappa, where the guard is (mu / kappa)^2 of the bulk
energy: nothing. Where a cell at a re-entrant edge would collapse, it is as stiff as the shear.
"""

WILD = 0.3, 3.0
"""Bounds of J beyond which a point may not have a strain of its own."""

CHUNK = 1024
"""Cells assembled at a time: bounds the memory for cell matrices."""


@dataclass(frozen=True)
class OgdenLaw:
    """W = sum 2 mu_i / alpha_i^2 (sum_k lbar_k^alpha_i - 3) + U(J), U'' = kappa at J = 1.

    mu, alpha : (n_terms,) [MPa], [-]; kappa : bulk modulus [MPa]
    """

    mu: tuple[float, ...]
    alpha: tuple[float, ...]
    kappa: float

    @classmethod
    def elastic(cls, youngs_modulus: float, poisson_ratio: float) -> OgdenLaw:
        """A neo-Hookean solid with the given small-strain constants.

        youngs_modulus : [MPa]; poisson_ratio : below 0.5
        """
        shear = youngs_modulus / (2 * (1 + poisson_ratio))
        return cls((shear,), (2.0,), youngs_modulus / (3 * (1 - 2 * poisson_ratio)))


class Solid:
    """Cells of one block, with one material law per region."""

    def __init__(
        self,
        mesh: Mesh,
        laws: Mapping[str, OgdenLaw],
        block: int = 0,
        pressure: PressureSpace = "linear",
        first_own_unknown: int | None = None,
    ):
        """Prepare shape gradients and the numbering.

        mesh : the mesh; block : number of its cell block
        laws : region name to material, `*` stands for every other region
        pressure : the pressure space that goes with the displacement element
        first_own_unknown : number of the first pressure unknown; after the displacements if not given

        Raises ConfigError when a region has no material.
        """
        self.block: CellBlock = mesh.blocks[block]
        self.kind = self.block.element
        self.pressure = pressure
        self._prepare_geometry(mesh)
        self._prepare_laws(mesh, laws)
        self._history = np.empty((*self.weights.shape, 0))
        self._strains = self._no_strains = np.empty((*self.weights.shape, 0))
        start = 3 * len(mesh.points) if first_own_unknown is None else first_own_unknown
        self._number_unknowns(start)

    @property
    def pattern(self) -> IntArray:
        """(n_cells, n_kept) numbers of the unknowns that stay."""
        return self.unknowns[:, : self.n_kept]

    @property
    def eliminated(self) -> IntArray:
        """Numbers of the unknowns that are eliminated inside the cells."""
        return self.unknowns[:, self.n_kept :].ravel()

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put cell matrices and residuals into the sink.

        state : where to evaluate; sink : takes the parts; found : energy, smallest Jacobian, magnitude
        """
        n_cells = len(self.unknowns)
        for first in range(0, n_cells, CHUNK):
            part = slice(first, min(first + CHUNK, n_cells))
            n = part.stop - first
            matrices, residuals = self._matrices[:n], self._residuals[:n]
            assemble_cells(
                state.unknowns,
                self.unknowns[part],
                self.gradients[part],
                self.weights[part],
                self.pressure_shapes[part],
                self.material[part],
                *self.constants,
                self._history[part],
                self._strains[part],
                self._displacement_slot,
                self._pressure_slot,
                self.n_kept,
                sink.stiff,
                matrices,
                residuals,
                self._factors[part],
                self._pivots[part],
                self._scaled[part],
                self._energy[part],
                self._smallest[part],
                self._magnitude[part],
                self._interior[part],
            )
            sink.add(self, first, matrices, residuals)
        found.energy += float(self._energy.sum())
        found.min_jacobian = min(found.min_jacobian, float(self._smallest.min()))
        found.magnitude = max(found.magnitude, float(self._magnitude.max()))
        found.interior = max(found.interior, float(self._interior.max()))

    def recover(self, step: FloatArray) -> None:
        """Fill in the interior unknowns of a Newton step.

        step : (n,) in and out
        """
        recover_cells(step, self.unknowns, self.n_kept, self._factors, self._scaled)

    @property
    def displacement_slots(self) -> IntArray:
        """(n_cells, 3 n_nodes) numbers of each cell's displacements, node by node."""
        return np.ascontiguousarray(self.unknowns[:, self._displacement_slot])

    def remember(self, factor: FloatArray, history: FloatArray) -> None:
        """Scale the isochoric law of each region and add a constant second Piola-Kirchhoff stress.

        factor : (n_regions,) on the law's moduli
        history : (n_cells, n_q, 6) components 11, 22, 33, 12, 13, 23 [MPa], see `memory`
        """
        mu, alpha, kappa = self._law
        self.constants = (factor[:, None] * mu, alpha, kappa)
        self._history = history

    @property
    def strains(self) -> FloatArray:
        """(n_cells, n_q, 6) components 11, 22, 33, 12, 13, 23 of C that each point has by itself."""
        return self._strains

    def blend(
        self,
        states: Sequence[tuple[float, FloatArray]],
        at: FloatArray,
        kept: FloatArray | None = None,
    ) -> None:
        """Give each point a strain of its own (`mixed_point`), a sum of shares of those of some states.

        states : shares and unknowns; at : (n,) unknowns whose strain serves where the sum is no strain
        kept : (n_cells, n_q, 6) added to the sum, overwritten
        """
        slots = self.displacement_slots
        self._strains = np.zeros((*self.weights.shape, 6)) if kept is None else kept
        for share, unknowns in states:
            add_strains(unknowns, slots, self.gradients, share, self._strains)
        replace_wild_strains(at, slots, self.gradients, *WILD, self._strains)

    def bind(self) -> None:
        """Let the strain of each point be that of the displacements again."""
        self._strains = self._no_strains

    def stresses(self, state: State) -> tuple[FloatArray, FloatArray]:
        """Cauchy stress (n_cells, n_q, 3, 3) [MPa] and J (n_cells, n_q) at the quadrature points.

        state : where to evaluate
        """
        n_cells, n_q = self.weights.shape
        cauchy, jacobians = np.empty((n_cells, n_q, 3, 3)), np.empty((n_cells, n_q))
        point_stresses(
            state.unknowns,
            self.unknowns,
            self.gradients,
            self.pressure_shapes,
            self.material,
            *self.constants,
            self._history,
            self._displacement_slot,
            self._pressure_slot,
            cauchy,
            jacobians,
        )
        return cauchy, jacobians

    def stresses_at(self, state: State, cells: IntArray, reference: FloatArray) -> FloatArray:
        """Cauchy stress at given places of some cells, (n, n_points, 3, 3) [MPa].

        state : where to evaluate; cells : (n,) their numbers; reference : (n_points, 3) places in each cell
        """
        kind, nodes = self.kind, self.block.nodes[cells]
        slopes = kind.shape_gradient(reference)
        inverse = np.linalg.inv(np.einsum("cai,qaj->cqij", self._rest[nodes], slopes, optimize=True))
        gradients = np.ascontiguousarray(np.einsum("qaj,cqji->cqai", slopes, inverse, optimize=True))
        points = np.einsum("qa,cai->cqi", kind.shape(reference), self._rest[nodes])
        cauchy, jacobians = (
            np.empty((len(cells), len(reference), 3, 3)),
            np.empty((len(cells), len(reference))),
        )
        carry = kind.shape(reference) @ np.linalg.pinv(kind.shape(kind.quadrature_points))
        point_stresses(
            state.unknowns,
            self.unknowns[cells],
            gradients,
            self._pressure_shapes(cells, reference, points),
            self.material[cells],
            *self.constants,
            np.ascontiguousarray(np.einsum("pq,cqi->cpi", carry, self._history[cells])),
            self._displacement_slot,
            self._pressure_slot,
            cauchy,
            jacobians,
        )
        return cauchy

    def _prepare_geometry(self, mesh: Mesh) -> None:
        kind, block = self.kind, self.block
        self._rest = mesh.points
        matrices = jacobian_at(mesh.points, block, kind.quadrature_points)
        determinants = np.linalg.det(matrices)
        inverse = np.linalg.inv(matrices)
        reference = kind.shape_gradient(kind.quadrature_points)
        self.gradients = np.ascontiguousarray(np.einsum("qaj,cqji->cqai", reference, inverse, optimize=True))
        self.weights = np.ascontiguousarray(determinants * kind.quadrature_weights)
        self.points = np.einsum("qa,cai->cqi", kind.shape(kind.quadrature_points), mesh.points[block.nodes])
        self.pressure_shapes = self._pressure_shapes(slice(None), kind.quadrature_points, self.points)

    def _pressure_shapes(
        self, cells: slice | IntArray, reference: FloatArray, points: FloatArray
    ) -> FloatArray:
        """Shape functions of the pressure at points (n_cells, n_q, 3) with those places in the cell."""
        n_cells, n_q = points.shape[:2]
        if self.pressure == "none":
            return np.empty((n_cells, n_q, 0))
        if self.pressure == "constant":
            return np.ones((n_cells, n_q, 1))
        if self.pressure == "continuous":
            shape = self.kind.corner_shape(reference)
            return np.broadcast_to(shape, (n_cells, *shape.shape)).copy()
        # Linear in space (not in the reference cell): optimal also on distorted cells,
        # Boffi and Gastaldi, Math. Models Methods Appl. Sci. 12, 2002.
        weights = self.weights[cells]
        volume = weights.sum(axis=1)
        centre = np.einsum("cq,cqi->ci", weights, self.points[cells]) / volume[:, None]
        local = (points - centre[:, None]) / np.cbrt(volume)[:, None, None]
        return np.concatenate([np.ones((n_cells, n_q, 1)), local], axis=2)

    def _prepare_laws(self, mesh: Mesh, laws: Mapping[str, OgdenLaw]) -> None:
        rows = []
        for region in mesh.regions:
            law = laws.get(region, laws.get("*"))
            if law is None:
                raise ConfigError(f"region `{region}` has no material; materials: {', '.join(sorted(laws))}")
            rows.append(law)
        n_terms = max(len(law.mu) for law in rows)
        mu, alpha = np.zeros((len(rows), n_terms)), np.ones((len(rows), n_terms))
        for row, law in enumerate(rows):
            mu[row, : len(law.mu)], alpha[row, : len(law.alpha)] = law.mu, law.alpha
        kappa = np.array([self._bulk_shares(law) for law in rows])
        self._law: tuple[FloatArray, FloatArray, FloatArray] = (mu, alpha, kappa)
        self.constants = self._law
        self.material = self.block.region
        self._law_number = np.array([rows.index(law) for law in rows])

    def _bulk_shares(self, law: OgdenLaw) -> tuple[float, float, float]:
        """The bulk modulus on J itself, through the pressure field, and the guard [MPa]."""
        if self.pressure == "none":
            return law.kappa, 1e-9, 0.0
        shear = sum(law.mu)
        direct = min(SLACK_STIFFNESS * shear, 0.5 * law.kappa)
        return direct, law.kappa - direct, max(0.0, law.kappa - GUARD_FROM * shear)

    def _number_unknowns(self, first_own: int) -> None:
        kind, nodes = self.kind, self.block.nodes
        n_cells, n_p = len(nodes), self.pressure_shapes.shape[2]
        if self.pressure == "continuous":
            # Continuous within a material: at a joint of two, the pressure jumps.
            apart = self._law_number[self.material][:, None] * (nodes.max() + 1)
            places, numbers = np.unique(apart + nodes[:, : kind.n_corners], return_inverse=True)
            pressures = first_own + numbers.reshape(n_cells, n_p)
            self.n_own = len(places)
        else:
            self.n_own = n_cells * n_p
            pressures = first_own + np.arange(self.n_own).reshape(n_cells, n_p)
        displacements = (3 * nodes[:, :, None] + np.arange(3)).reshape(n_cells, -1)
        n_shared = 3 * kind.n_shared
        shared, interior = displacements[:, :n_shared], displacements[:, n_shared:]
        if self.pressure == "continuous":
            columns, self.n_kept = [shared, pressures, interior], n_shared + n_p
            slots = np.r_[np.arange(n_shared), n_shared + n_p + np.arange(interior.shape[1])]
            self._pressure_slot = n_shared + np.arange(n_p)
        else:
            columns, self.n_kept = [shared, interior, pressures], n_shared
            slots = np.arange(displacements.shape[1])
            self._pressure_slot = displacements.shape[1] + np.arange(n_p)
        self._displacement_slot = slots
        self.unknowns = np.ascontiguousarray(np.hstack(columns))
        n_local = self.unknowns.shape[1]
        self._factors = np.empty((n_cells, n_local - self.n_kept, n_local))
        self._pivots, self._scaled = np.empty((2, n_cells, n_local - self.n_kept))
        self._energy, self._smallest, self._magnitude, self._interior = np.empty((4, n_cells))
        chunk = min(CHUNK, n_cells)
        self._matrices = np.empty((chunk, self.n_kept, self.n_kept))
        self._residuals = np.empty((chunk, self.n_kept))
