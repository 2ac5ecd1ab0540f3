"""Dead traction: a force per undeformed area that keeps its direction while the solid deforms.

Its work is scale int t . u dA over the undeformed facets: a constant residual, no stiffness.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.elements import element_kind
from tubefoot.fea.items import Evaluation, Sink, State
from tubefoot.fea.mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Traction:
    """A uniform dead load on a facet set; `scale`, the share that acts, may be changed between steps."""

    def __init__(self, mesh: Mesh, facets: str, traction: tuple[float, float, float], scale: float = 1.0):
        """Integrate the nodal forces.

        mesh : the mesh; facets : name of the loaded facet set
        traction : force per undeformed area along x, y, z [MPa]; scale : share of it that acts
        """
        self.scale = scale
        loaded = mesh.facet_set(facets)
        kind = element_kind(loaded.kind)
        tangents = np.einsum(
            "fai,qas->fqsi",
            mesh.points[loaded.nodes],
            kind.shape_gradient(kind.quadrature_points),
            optimize=True,
        )
        areas = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=-1)
        shares = (areas * kind.quadrature_weights) @ kind.shape(kind.quadrature_points)
        self._forces: FloatArray = (shares[:, :, None] * np.asarray(traction, float)).reshape(len(shares), -1)
        self.pattern: IntArray = (3 * loaded.nodes[:, :, None] + np.arange(3)).reshape(len(shares), -1)
        self._stiffness = np.zeros((*self._forces.shape, self._forces.shape[1]))

    def assemble(self, state: State, sink: Sink, found: Evaluation) -> None:
        """Put the load into the sink.

        state : does not matter to a dead load; sink : takes the forces
        found : its magnitude covers the forces; a load stores no energy
        """
        forces = self.scale * self._forces
        found.magnitude = max(found.magnitude, float(np.abs(forces).max(initial=0.0)))
        sink.add(self, 0, self._stiffness, -forces)

    def recover(self, step: FloatArray) -> None:
        """Nothing was eliminated.

        step : unchanged
        """
