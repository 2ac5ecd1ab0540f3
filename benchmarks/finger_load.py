"""The load case that all programs solve: the reference finger, clamped, with a pressure in either chamber.

The finger's mesh of 27-node hexahedra is recast for elements that other programs have: nodes are dropped
(20 or 8 nodes), or each cell is cut into six ten-node tetrahedra.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured import Usage
from tubefoot.design.finger import FingerDesign, load_design
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.measures import SectionRotation
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.profile_mesh import Divisions
from tubefoot.fea.recast import recast
from tubefoot.units import DEG, KPA

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

HANDS = ("right", "left")


@dataclass(frozen=True)
class FingerLoad:
    """A meshed finger with its chamber pressures.

    mesh : half of it; pressures : right, left [MPa]; design : for the material
    """

    design: FingerDesign
    mesh: Mesh
    pressures: tuple[float, float]

    @property
    def held(self) -> NDArray[np.bool_]:
        """(n_points, 3) mask of the displacement components that are zero."""
        held = np.zeros(self.mesh.points.shape, dtype=bool)
        for axis, points in clamp_half_finger(self.mesh).items():
            held[points, axis] = True
        return held

    @property
    def tip(self) -> IntArray:
        """Numbers of the points of the tip face."""
        return self.mesh.facet_set("tip").points

    def bend_deg(self, displacements: FloatArray) -> float:
        """Turn of the tip face.

        displacements : (n_points, 3) [mm]; only those of the tip are looked at
        """
        angle, _ = SectionRotation(self.mesh, self.tip)(displacements.ravel())
        return angle / DEG

    def save(self, path: Path) -> Path:
        """Write points, cells, held components, walls, pressures and material for another program."""
        body, block = self.design.body, self.mesh.blocks[0]
        walls = {f"wall_{hand}": self.mesh.facet_set(f"cavity_{hand}").nodes for hand in HANDS}
        np.savez(
            path,
            points=self.mesh.points,
            cells=block.nodes,
            kind=block.kind,
            held=self.held,
            pressures=self.pressures,
            mu=body.scale * np.array(body.mu_mpa),
            alpha=body.alpha,
            bulk=body.bulk_modulus_mpa,
            **walls,
        )
        return path


@dataclass(frozen=True)
class PeerRun:
    """What another program made of the load case.

    iterations : of Newton's method, those of increments that were given up included
    displacements : (n_points, 3) [mm], correct on the tip at least; None when it did not reach the full load
    message : why not
    """

    usage: Usage
    iterations: int
    displacements: FloatArray | None
    message: str = ""


def divisions_named(design: FingerDesign, name: str) -> Divisions:
    """Divisions by a short name: an element size as "2", or "3/2" for size 3 with every cell halved."""
    size, _, factor = name.partition("/")
    divisions = Divisions.of(design.profile, float(size))
    return divisions.refined(int(factor)) if factor else divisions


def load_case(design_path: Path, mesh_name: str, kind: str, pressures_kpa: tuple[float, float]) -> FingerLoad:
    """The load case on a mesh of the given fineness, see `divisions_named`, and cell kind."""
    design = load_design(design_path)
    mesh = finger_mesh(design.profile, divisions=divisions_named(design, mesh_name))
    right, left = pressures_kpa
    return FingerLoad(design, recast(mesh, kind), (right * KPA, left * KPA))
