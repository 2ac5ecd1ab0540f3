"""A thin elastic film on a facet set, tied to the solid: the bonded seam, a label, a skin.

Membrane of a St. Venant-Kirchhoff solid in plane stress: with the Green strain e of the film's own tangents,

    W = h E / (2 (1 - nu^2)) ((1 - nu) e : e + nu (tr e)^2)   per undeformed area,

no bending stiffness, which is h^2 / 12 small. Valid for strains of the film up to some ten per cent; in
compression it softens and fails below a stretch of 0.58.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.ogden import FLAGS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@njit(cache=True, fastmath=FLAGS)
def assemble_film(positions, slopes, weights, stiffness, energy, residuals, matrices):  # type: ignore[no-untyped-def]
    """Energy, residual and tangent of membrane facets.

    positions : (n, n_nodes, 3) [mm]; slopes : (n, n_q, n_nodes, 2) along orthonormal rest tangents [1/mm]
    weights : (n, n_q) rest areas [mm^2]; stiffness : (2,), h E / (1 - nu^2) times (1 - nu) and nu [N/mm]
    energy : (n,), residuals : (n, 3 n_nodes), matrices : (n, 3 n_nodes, 3 n_nodes) out
    """
    n, n_nodes = positions.shape[:2]
    energy[:] = 0.0
    residuals[:] = 0.0
    matrices[:] = 0.0
    tangent = np.empty((2, 3))
    strain = np.empty((2, 2))
    stress = np.empty((2, 2))
    # Rates of the strain components 11, 22, 12 by the nodal positions.
    rate = np.empty((3, 3 * n_nodes))
    for facet in range(n):
        for q in range(weights.shape[1]):
            slope, weight = slopes[facet, q], weights[facet, q]
            tangent[:] = 0.0
            for a in range(n_nodes):
                for i in range(3):
                    tangent[0, i] += slope[a, 0] * positions[facet, a, i]
                    tangent[1, i] += slope[a, 1] * positions[facet, a, i]
            for s in range(2):
                for t in range(2):
                    dot = 0.0
                    for i in range(3):
                        dot += tangent[s, i] * tangent[t, i]
                    strain[s, t] = 0.5 * (dot - (1.0 if s == t else 0.0))
            trace = strain[0, 0] + strain[1, 1]
            for s in range(2):
                for t in range(2):
                    stress[s, t] = stiffness[0] * strain[s, t] + (stiffness[1] * trace if s == t else 0.0)
                    energy[facet] += 0.5 * weight * stress[s, t] * strain[s, t]
            for a in range(n_nodes):
                for i in range(3):
                    k = 3 * a + i
                    rate[0, k] = slope[a, 0] * tangent[0, i]
                    rate[1, k] = slope[a, 1] * tangent[1, i]
                    rate[2, k] = 0.5 * (slope[a, 0] * tangent[1, i] + slope[a, 1] * tangent[0, i])
            for k in range(3 * n_nodes):
                work = stress[0, 0] * rate[0, k] + stress[1, 1] * rate[1, k] + 2 * stress[0, 1] * rate[2, k]
                residuals[facet, k] += weight * work
                along0 = (stiffness[0] + stiffness[1]) * rate[0, k] + stiffness[1] * rate[1, k]
                along1 = (stiffness[0] + stiffness[1]) * rate[1, k] + stiffness[1] * rate[0, k]
                across = 2.0 * stiffness[0] * rate[2, k]
                for m in range(3 * n_nodes):
                    matrices[facet, k, m] += weight * (
                        along0 * rate[0, m] + along1 * rate[1, m] + across * rate[2, m]
                    )
            for a in range(n_nodes):
                for b in range(n_nodes):
                    geometric = 0.0
                    for s in range(2):
                        for t in range(2):
                            geometric += slope[a, s] * stress[s, t] * slope[b, t]
                    for i in range(3):
                        matrices[facet, 3 * a + i, 3 * b + i] += weight * geometric


class Film:
    """An elastic film on a facet set; as an item it adds its membrane energy."""

    def __init__(
        self, mesh: Mesh, facets: str, thickness: float, youngs_modulus: float, poisson_ratio: float
    ):
        """Prepare the film's tangents at rest.

        mesh : the mesh; facets : name of the facet set that bears it
        thickness : of the modelled share of the film [mm]; youngs_modulus : [MPa]; poisson_ratio : [-]
        """
        film = mesh.facet_set(facets)
        kind = element_kind(film.kind)
        self._nodes, self._rest = film.nodes, mesh.points
        reference = kind.shape_gradient(kind.quadrature_points)
        tangents = np.einsum("qas,fai->fqsi", reference, mesh.points[film.nodes], optimize=True)
        # Orthonormal tangents by Gram-Schmidt: g = L f with a lower triangular L.
        first = np.linalg.norm(tangents[..., 0, :], axis=-1)
        direction = tangents[..., 0, :] / first[..., None]
        shear = np.einsum("fqi,fqi->fq", tangents[..., 1, :], direction)
        second = np.linalg.norm(tangents[..., 1, :] - shear[..., None] * direction, axis=-1)
        along_first = reference[None, :, :, 0] / first[..., None]
        along_second = (reference[None, :, :, 1] - shear[..., None] * along_first) / second[..., None]
        self._slopes = np.ascontiguousarray(np.stack([along_first, along_second], axis=-1))
        self._weights = first * second * kind.quadrature_weights
        modulus = thickness * youngs_modulus / (1.0 - poisson_ratio**2)
        self._stiffness = np.array([modulus * (1.0 - poisson_ratio), modulus * poisson_ratio])
        self.pattern: IntArray = (3 * film.nodes[:, :, None] + np.arange(3)).reshape(len(film.nodes), -1)
        size = self.pattern.shape[1]
        self._energy = np.empty(len(film.nodes))
        self._residuals = np.empty((len(film.nodes), size))
        self._matrices = np.empty((len(film.nodes), size, size))

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the film's forces and stiffness into the sink.

        state : where to evaluate; sink : takes the parts; found : energy and magnitude
        """
        n = self._rest.size
        positions = (self._rest + state.unknowns[:n].reshape(-1, 3))[self._nodes]
        assemble_film(
            positions,
            self._slopes,
            self._weights,
            self._stiffness,
            self._energy,
            self._residuals,
            self._matrices,
        )
        found.energy += float(self._energy.sum())
        found.magnitude = max(found.magnitude, float(np.abs(self._residuals).max(initial=0.0)))
        sink.add(self, 0, self._matrices, self._residuals)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """
