"""The sparse system against dense sums, the factorisations against NumPy and against each other."""

import numpy as np
import pytest
import scipy.sparse as sp
from probe import DenseSink

from octant import sphere_octant
from tubefoot.fea import factorise
from tubefoot.fea.assembly import SparseSystem
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.factorise import Pardiso, SingularMatrixError, SuperLU, factoriser
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.mesh import Mesh
from tubefoot.fea.solid import OgdenLaw, Solid

RUBBER = OgdenLaw((0.4, 0.003), (2.0, 5.0), 30.0)


def indefinite(n=180, seed=0):
    """Sparse symmetric matrix with eigenvalues of both signs, and its upper triangle with full diagonal."""
    rng = np.random.default_rng(seed)
    lower = sp.random(n, n, 0.03, random_state=rng)
    matrix = (lower + lower.T + sp.diags(rng.choice([-2.0, 3.0], n))).tocsr()
    upper = sp.triu(matrix, format="csr")
    upper.sort_indices()
    return matrix.toarray(), upper


@pytest.mark.parametrize("make", [Pardiso, SuperLU])
def test_solutions_are_those_of_numpy_also_for_new_values_in_the_same_pattern(make):
    dense, upper = indefinite()
    solver = make(upper.indptr, upper.indices)
    right = np.random.default_rng(1).normal(size=(len(dense), 3))
    for scale in (1.0, -0.5):
        solver.factorise(scale * upper.data)
        assert solver.solve(right) == pytest.approx(np.linalg.solve(scale * dense, right), abs=1e-9)


def test_pardiso_counts_the_negative_eigenvalues():
    dense, upper = indefinite()
    solver = Pardiso(upper.indptr, upper.indices)
    solver.factorise(upper.data)
    assert solver.negative_pivots == int((np.linalg.eigvalsh(dense) < 0).sum()) > 0
    assert solver.flops is None or solver.flops >= 0


@pytest.mark.parametrize("make", [Pardiso, SuperLU])
def test_values_that_are_not_finite_are_refused(make):
    _, upper = indefinite()
    data = upper.data.copy()
    data[5] = np.nan
    with pytest.raises(SingularMatrixError, match="not finite"):
        make(upper.indptr, upper.indices).factorise(data)


def test_a_singular_matrix_is_refused_by_superlu():
    upper = sp.csr_matrix(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    with pytest.raises(SingularMatrixError):
        SuperLU(upper.indptr, upper.indices).factorise(upper.data)


def test_without_mkl_superlu_is_taken(monkeypatch):
    def no_mkl(*_):
        raise ImportError

    _, upper = indefinite()
    assert factoriser(upper.indptr, upper.indices).name == "MKL PARDISO"
    monkeypatch.setattr(factorise, "Pardiso", no_mkl)
    assert factoriser(upper.indptr, upper.indices).name == "SuperLU"


@pytest.fixture(scope="module")
def octant():
    return sphere_octant("hexahedron27", 1.0, 1.6, 1, 1)


def held(mesh):
    return {axis: mesh.facet_set(f"{name}_min").points for axis, name in enumerate("xyz")}


def inflating(mesh: Mesh, pressure_space="linear"):
    solid = Solid(mesh, {"*": RUBBER}, pressure=pressure_space)
    return Model(mesh, [solid], held(mesh), [Cavity(mesh, "inside", 0)], Drive(("volume",), (1.0,)))


@pytest.mark.parametrize("pressure_space", ["linear", "continuous"])
def test_sparse_sums_are_the_dense_sums_of_all_items(octant, pressure_space):
    model = inflating(octant, pressure_space)
    unknowns = np.random.default_rng(2).uniform(-0.02, 0.02, model.n_unknowns)
    state = State(unknowns, np.array([0.1]), 0.0)
    found = model.evaluate(state)
    sink, expected = DenseSink(model.n_unknowns), Evaluation()
    for item in model.items:
        item.assemble(state, sink, expected)
    free = model.system.free
    upper = model.system.matrix().toarray()
    full = upper + np.triu(upper, 1).T
    scale = np.abs(full).max()
    assert np.abs(full - sink.matrix[np.ix_(free, free)]).max() < 1e-13 * scale
    assert model.system.residual[free] == pytest.approx(sink.residual[free], abs=1e-13 * scale)
    assert found.energy == pytest.approx(expected.energy, rel=1e-14)


def test_an_unknown_that_no_cell_touches_is_left_out_of_the_system():
    mesh = sphere_octant("hexahedron27", 1.0, 1.6, 1, 1)
    stray = Mesh(np.vstack([mesh.points, [9.0, 9.0, 9.0]]), mesh.blocks, mesh.regions, mesh.facets)
    solid = Solid(stray, {"*": RUBBER})
    size = stray.points.size + solid.n_own
    system = SparseSystem(size, [solid], np.zeros(size, dtype=bool))
    assert not np.isin(np.arange(3 * len(mesh.points), stray.points.size), system.free).any()


def test_both_factorisations_lead_to_the_same_equilibrium(octant):
    found = []
    for make in (Pardiso, SuperLU):
        model = inflating(octant)
        model.solver = make(model.system.indptr, model.system.indices)
        found.append(model.solve(model.rest(), Control("parameter", 0.2)))
    assert found[0].iterations == found[1].iterations > 1
    assert found[1].state.unknowns == pytest.approx(found[0].state.unknowns, abs=1e-10)
    assert found[1].state.pressures == pytest.approx(found[0].state.pressures, rel=1e-9)


def test_inertia_of_a_stable_tangent_is_the_number_of_pressure_unknowns(octant):
    """A saddle point has as many negative eigenvalues as pressures, and none when they are eliminated."""
    for space, expected in (("linear", 0), ("continuous", None)):
        model = inflating(octant, space)
        model.evaluate(model.rest())
        solver = Pardiso(model.system.indptr, model.system.indices)
        solver.factorise(model.system.data)
        assert solver.negative_pivots == (model.solids[0].n_own if expected is None else expected)
