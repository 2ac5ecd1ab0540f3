"""Dead traction: resultant, direction, work; its stiffness is zero."""

import numpy as np
import pytest
from probe import DenseSink

from mapped_box import mapped_box
from octant import sphere_octant
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.traction import Traction


@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron20", "hexahedron8", "tetra10"])
def test_resultant_and_moment_of_a_uniform_load(kind):
    mesh = mapped_box(kind, (2, 2, 2), lambda points: points * [2.0, 3.0, 4.0])
    load = Traction(mesh, "x_max", (0.1, -0.2, 0.3), scale=0.5)
    sink, found = DenseSink(mesh.points.size), Evaluation()
    rng = np.random.default_rng(0)
    load.assemble(State(rng.normal(size=mesh.points.size), np.zeros(0), 0.0), sink, found)
    forces = -sink.residual.reshape(-1, 3)
    assert forces.sum(axis=0) == pytest.approx(0.5 * 12.0 * np.array([0.1, -0.2, 0.3]), rel=1e-13)
    moment = np.cross(mesh.points - [2.0, 1.5, 2.0], forces).sum(axis=0)
    assert moment == pytest.approx(np.zeros(3), abs=1e-12)
    assert not sink.matrix.any()
    assert found.energy == 0.0
    assert found.magnitude >= np.abs(sink.residual).max() / 4


def test_a_load_on_a_curved_wall_acts_on_its_true_area():
    mesh = sphere_octant("hexahedron27", 1.0, 1.6, 1, 3)
    sink = DenseSink(mesh.points.size)
    Traction(mesh, "outside", (0.0, 1.0, 0.0)).assemble(
        State(np.zeros(mesh.points.size), np.zeros(0), 0.0), sink, Evaluation()
    )
    assert -sink.residual.sum() == pytest.approx(np.pi / 2 * 1.6**2, rel=2e-4)
