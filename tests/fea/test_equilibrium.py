"""Newton's method on the bordered system: its tangent as a whole, its order, and how it ends."""

import numpy as np
import pytest

from mapped_box import mapped_box, symmetry
from octant import sphere_octant
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive, Plane, air_uptake
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.step import StepFailed, Tolerance
from tubefoot.fea.traction import Traction

RUBBER = OgdenLaw((0.63 * 1.3 / 2, 0.0012 * 5 / 2, 0.01), (1.3, 5.0, -2.0), 20.0)


def held(mesh):
    return {axis: mesh.facet_set(f"{name}_min").points for axis, name in enumerate("xyz")}


@pytest.fixture(scope="module")
def octant():
    return sphere_octant("hexahedron20", 1.0, 1.6, 1, 2)


def tip(mesh, point):
    number = int(np.argmin(np.linalg.norm(mesh.points - point, axis=1)))

    def measure(unknowns):
        gradient = np.zeros(mesh.points.size)
        gradient[3 * number] = 2.0 * unknowns[3 * number] + 1.0
        return float(unknowns[3 * number] ** 2 + unknowns[3 * number]), gradient

    return measure


CONTROLS = {
    "parameter": Control("parameter", 0.3),
    "pressure": Control("pressure", 0.05, cavity=1),
    "volume_change": Control("volume_change", 0.1),
    "measure": "tip",
    "plane": "plane",
}
DRIVES = {
    "pump": Drive.pump(),
    "volume and pressure": Drive(("volume", "pressure"), (1.0, 0.2)),
    "pressures": Drive.pressures(2),
}


def equations(model, control, state):
    """All residuals of the bordered system, written out from their definition."""
    model.evaluate(state)
    rows = [model.system.residual[model.system.free]]
    for cavity, kind, rate, pressure in zip(
        model.cavities, model.drive.kind, model.drive.rate, state.pressures, strict=True
    ):
        if kind == "volume":
            uptake = air_uptake(pressure, cavity.air_volume)[0]
            rows.append([cavity.volume - cavity.rest_volume + uptake - rate * state.parameter])
        else:
            rows.append([pressure - rate * state.parameter])
    if control.quantity == "parameter":
        rows.append([state.parameter - control.target])
    elif control.quantity == "pressure":
        rows.append([state.pressures[control.cavity] - control.target])
    elif control.quantity == "volume_change":
        cavity = model.cavities[control.cavity]
        rows.append([cavity.volume - cavity.rest_volume - control.target])
    elif control.quantity == "plane":
        rows.append([control.plane.distance(state) - control.target])
    else:
        rows.append([control.measure(state.unknowns)[0] - control.target])
    return np.concatenate(rows)


@pytest.mark.parametrize("pressure_space", ["none", "continuous"])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("control", CONTROLS)
def test_newton_step_solves_the_linearised_bordered_system(octant, pressure_space, drive, control):
    """Along the step the central difference of every equation is the equation's negative value."""
    solid = Solid(octant, {"*": RUBBER}, pressure=pressure_space)
    cavities = [Cavity(octant, "inside", 0, air_volume=0.7), Cavity(octant, "outside", 1, air_volume=1.3)]
    model = Model(octant, [solid], held(octant), cavities, DRIVES[drive])
    wanted = CONTROLS[control]
    if wanted == "tip":
        wanted = Control("measure", 0.2, measure=tip(octant, [1.0, 0.0, 0.0]))
    rng = np.random.default_rng(6)
    if wanted == "plane":
        parts = (np.zeros(model.n_unknowns), np.array([0.3, -0.2]), 0.7)
        parts[0][model.system.free] = rng.standard_normal(len(model.system.free))
        wanted = Control("plane", 0.4, plane=Plane(model.rest(), State(*parts)))
    state = State(np.zeros(model.n_unknowns), np.array([0.04, -0.02]), 0.15)
    free = model.system.free
    state.unknowns[free] = rng.uniform(-0.01, 0.01, len(free))
    start = equations(model, wanted, state)
    borders = model.borders(state, wanted)
    model.factorise(borders)
    step, along = model.newton_step(state, borders)
    small = 1e-5

    def moved(direction, length):
        return State(
            state.unknowns + length * direction.unknowns,
            state.pressures + length * direction.pressures,
            state.parameter + length * direction.parameter,
        )

    def slope(direction):
        above, below = (equations(model, wanted, moved(direction, s * small)) for s in (1, -1))
        return (above - below) / (2 * small)

    n = len(free)
    error = np.abs(slope(step) + start)
    assert error[:n].max() < 1e-6 * np.abs(start[:n]).max()
    assert error[n:].max() < 1e-6 * max(np.abs(start[n:]).max(), 0.01)
    # The path's direction keeps equilibrium and the drive; only the control changes along it, by one.
    size = max(1.0, np.abs(along.unknowns).max(), abs(along.parameter))
    towards = State(along.unknowns / size, along.pressures / size, along.parameter / size)
    path = slope(towards)
    assert np.abs(path[:n]).max() < 1e-6 * np.abs(start[:n]).max()
    assert np.abs(path[n:-1]).max() < 1e-6
    assert size * path[-1] == pytest.approx(1.0, rel=1e-5)


def test_newton_converges_quadratically(octant):
    solid = Solid(octant, {"*": RUBBER}, pressure="continuous")
    tight = Tolerance(force=1e-13, volume=1e-13)
    model = Model(
        octant, [solid], held(octant), [Cavity(octant, "inside", 0)], Drive(("volume",), (1.0,)),
        tolerance=tight,
    )  # fmt: skip
    step = model.solve(model.rest(), Control("parameter", 0.15))
    errors = np.array(step.residuals) * 1e-13
    assert errors[-1] < 1e-13
    orders = [np.log(c / b) / np.log(b / a) for a, b, c in zip(errors, errors[1:], errors[2:], strict=False)]
    assert max(orders) > 1.8


def test_step_reports_volume_energy_and_pressure_of_the_state_it_returns(octant):
    solid = Solid(octant, {"*": RUBBER}, pressure="continuous")
    model = Model(octant, [solid], held(octant), [Cavity(octant, "inside", 0)], Drive(("volume",), (1.0,)))
    step = model.solve(model.rest(), Control("parameter", 0.1))
    assert step.state.parameter == pytest.approx(0.1, rel=1e-8)
    assert step.volumes[0] - model.rest_volumes[0] == pytest.approx(0.1, rel=1e-7)
    assert step.energy == pytest.approx(model.evaluate(step.state).energy, rel=1e-13)
    landed = model.solve(step.state, Control("pressure", 1.1 * step.state.pressures[0]))
    assert landed.state.pressures[0] == pytest.approx(1.1 * step.state.pressures[0], rel=1e-8)
    assert landed.state.parameter > 0.1


def test_a_load_that_cannot_be_reached_ends_with_the_reason():
    mesh = mapped_box("hexahedron27", (1, 1, 1))
    pull = Traction(mesh, "x_max", (-60.0, 0.0, 0.0))
    model = Model(
        mesh,
        [Solid(mesh, {"*": RUBBER})],
        symmetry(mesh, x="x_min", y="y_min", z="z_min"),
        others=[pull],
    )
    with pytest.raises(StepFailed, match=r"inverts|no convergence|residual grew"):
        model.solve(model.rest(), Control("parameter", 0.0))


def test_no_air_column_is_drawn_beyond_vacuum(octant):
    solid = Solid(octant, {"*": RUBBER}, pressure="continuous")
    cavity = Cavity(octant, "inside", 0, air_volume=5.0)
    model = Model(octant, [solid], held(octant), [cavity], Drive(("volume",), (1.0,)))
    with pytest.raises(StepFailed):
        model.solve(model.rest(), Control("pressure", -0.11))


def test_unknowns_eliminated_in_the_cells_are_brought_to_equilibrium_too():
    """A change of them alone leaves no force on the others, to first order; it is no converged state."""
    mesh = mapped_box("hexahedron27", (1, 1, 2))
    solid = Solid(mesh, {"*": RUBBER}, pressure="linear")
    pull = Traction(mesh, "x_max", (0.05, 0.0, 0.0))
    held = symmetry(mesh, x="x_min", y="y_min", z="z_min")
    model = Model(mesh, [solid], held, others=[pull])
    control = Control("parameter", 0.0)
    right = model.solve(model.rest(), control)
    start = right.state.copy()
    start.unknowns[solid.eliminated] += 1e-6
    again = model.solve(start, control)
    assert again.iterations > 0
    wrong = np.abs(again.state.unknowns - right.state.unknowns)[solid.eliminated]
    assert wrong.max() < 1e-8


class Stop:
    """A spring that meets the end of a rod where that has gone far enough; it looks only when asked."""

    convex = False

    def __init__(self, mesh, where, gap, stiffness):
        self.numbers = 3 * mesh.facet_set(where).points
        self.pattern = self.numbers[:, None]
        self.gap, self.stiffness, self.touches = gap, stiffness, False

    def look(self, state):
        touched = bool(state.unknowns[self.numbers].mean() > self.gap)
        changed, self.touches = touched != self.touches, touched
        return changed

    def assemble(self, state, sink, found):
        pressed = self.stiffness * self.touches * (state.unknowns[self.numbers] - self.gap)
        sink.add(self, 0, np.full((len(pressed), 1, 1), self.stiffness * self.touches), pressed[:, None])

    def recover(self, step):
        pass


def test_a_state_that_meets_a_partner_on_the_way_is_not_taken_without_it():
    mesh = mapped_box("hexahedron27", (1, 1, 1))
    held = symmetry(mesh, x="x_min", y="y_min", z="z_min")
    pull = Traction(mesh, "x_max", (0.1, 0.0, 0.0))

    def pulled(gap):
        stop = Stop(mesh, "x_max", gap, 2.0)
        solid = Solid(mesh, {"*": RUBBER}, pressure="linear")
        model = Model(mesh, [solid], held, others=[pull, stop])
        step = model.solve(model.rest(), Control("parameter", 0.0))
        return float(step.state.unknowns[stop.numbers].mean()), stop

    free, missed = pulled(10.0)
    assert not missed.touches
    assert free > 0.02
    stopped, stop = pulled(0.4 * free)
    assert stop.touches
    assert 0.4 * free < stopped < 0.6 * free
