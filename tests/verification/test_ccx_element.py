"""Material and follower load against CalculiX, a program not of our making.

One 20-node element under a homogeneous deformation has forces at its nodes that depend on the material
alone; a finger of 20-node elements, displacement only, adds the follower pressure and Newton's method.
CalculiX prints seven digits, and its Newton iteration ends at 0.5 % of the mean force, mostly far below.
"""

import numpy as np
import pytest
from benchmarks.finger_load import FingerLoad
from benchmarks.peers_calculix import available, printed, run_deck, run_finger

from mapped_box import mapped_box
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.deck import material_card, mesh_cards
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger, finger_mesh
from tubefoot.fea.finger_model import ogden_law
from tubefoot.fea.items import State
from tubefoot.fea.recast import recast
from tubefoot.fea.solid import Solid
from tubefoot.units import KPA

pytestmark = pytest.mark.skipif(
    not available(), reason="needs the program ccx (Debian package calculix-ccx, installed by `make setup`)"
)

BODY = FingerDesign().body
DEFORMATIONS = {
    "tension": np.diag([1.6, 0.8, 0.8]),
    "compression": np.diag([0.6, 1.28, 1.3]),
    "equibiaxial": np.diag([1.4, 1.4, 0.51]),
    "simple shear": np.array([[1.0, 0.7, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "general": np.array([[1.3, 0.4, -0.1], [0.2, 0.9, 0.3], [-0.2, 0.1, 0.95]]),
}
"""Scaled to constant volume: the two programs weigh changes of volume by different laws."""


def nodal_forces(deformation, directory):
    """Forces of CalculiX and ours, (20, 3) each [N], at the nodes of a unit cube."""
    mesh = mapped_box("hexahedron20", (1, 1, 1))
    displacements = mesh.points @ (deformation - np.eye(3)).T
    rows = [
        f"{point + 1}, {axis + 1}, {axis + 1}, {value:.12g}"
        for point, vector in enumerate(displacements)
        for axis, value in enumerate(vector)
    ]
    deck = [
        *mesh_cards(mesh.points, mesh.blocks[0].nodes, "C3D20"),
        *material_card(BODY.mu_mpa, BODY.alpha, BODY.bulk_modulus_mpa),
        "*SOLID SECTION, ELSET=ALL, MATERIAL=BODY",
        "*STEP, NLGEOM",
        "*STATIC",
        "1.0, 1.0",
        "*BOUNDARY",
        *rows,
        "*NODE PRINT, NSET=NALL",
        "RF",
        "*END STEP",
        "",
    ]
    (directory / "element.inp").write_text("\n".join(deck))
    run_deck(directory, "element")
    theirs = printed(directory / "element.dat")
    model = Model(mesh, [Solid(mesh, {"*": ogden_law(BODY)}, pressure="none")], {0: np.array([0])})
    model.evaluate(State(displacements.ravel(), np.zeros(0), 0.0))
    ours = model.system.residual.reshape(-1, 3)
    assert np.abs(ours).max() > 1e-3
    return np.array([theirs[node] for node in range(1, 21)]), ours


@pytest.mark.parametrize("name", DEFORMATIONS)
def test_forces_of_one_element_are_those_of_calculix(name, tmp_path):
    deformation = DEFORMATIONS[name] / np.cbrt(np.linalg.det(DEFORMATIONS[name]))
    theirs, ours = nodal_forces(deformation, tmp_path)
    assert theirs == pytest.approx(ours, abs=2e-6 * np.abs(ours).max())


def test_bulk_modulus_is_that_of_calculix(tmp_path):
    """Pressure kappa (J - 1) there, kappa (1 - 1 / J) in our displacement element: J times as much there."""
    stretch = 1.001
    theirs, ours = nodal_forces(stretch * np.eye(3), tmp_path)
    assert theirs / stretch**3 == pytest.approx(ours, abs=1e-5 * np.abs(ours).max())


@pytest.mark.slow
def test_a_finger_of_displacement_elements_bends_as_in_calculix(tmp_path):
    design = FingerDesign().with_bellows(units=1)
    mesh = recast(finger_mesh(design.profile, 3.0), "hexahedron20")
    pressures = (20 * KPA, -25 * KPA)
    load = FingerLoad(design, mesh, pressures)
    found = run_finger(load, "C3D20", 0.25, tmp_path, threads=1)
    solid = Solid(mesh, {"*": ogden_law(design.body)}, pressure="none")
    cavities = [Cavity(mesh, f"cavity_{hand}", k) for k, hand in enumerate(("right", "left"))]
    drive = Drive(("pressure", "pressure"), pressures)
    model = Model(mesh, [solid], clamp_half_finger(mesh), cavities, drive)
    state = model.rest()
    for share in (0.5, 1.0):
        state = model.solve(state, Control("parameter", share)).state
    ours = load.bend_deg(state.unknowns[: mesh.points.size].reshape(-1, 3))
    assert abs(ours) > 1.0
    assert load.bend_deg(found.displacements) == pytest.approx(ours, rel=1e-4)
