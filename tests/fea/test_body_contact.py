"""Contact of two bodies: exact derivatives, balance, pressure between blocks, a sphere on a block (Hertz)."""

from dataclasses import replace

import numpy as np
import pytest
from probe import DenseSink

from mapped_box import mapped_box
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.body_contact import BodyContact
from tubefoot.fea.drive import Control
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.mean_hold import MeanHold
from tubefoot.fea.object_mesh import beside, object_mesh
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.touch import Touch

BARRIER = Barrier(reach=0.1, stiffness=0.5, depth=3.0, ahead=4.0)
SOFT = OgdenLaw.elastic(0.03, 0.45)
WALL_AT = 6.0


def block_before(thing, gap, n=2):
    """A block 6 x 6 mm with its face x_min at x = 6, and an object whose front is `gap` away from it."""
    block = mapped_box("hexahedron27", (n, n, n), lambda p: p * [3.0, 3.0, 6.0] + [WALL_AT, 0.0, -3.0])
    front = thing.points[:, 0].max()
    return beside(block, thing, (WALL_AT - gap - front, 0.0, 0.0))


def pressed(gap=0.03, seed=3):
    mesh = block_before(object_mesh((8.0, 9.0, 10.0), (0, 1, 2), 3.0), gap)
    contact = BodyContact(mesh, ["x_min"], "object_skin", barrier=BARRIER)
    unknowns = 0.01 * np.random.default_rng(seed).standard_normal(mesh.points.size)
    contact.look(State(unknowns, np.zeros(0), 0.0))
    return mesh, contact, unknowns


def evaluate(item, unknowns):
    sink, found = DenseSink(len(unknowns)), Evaluation()
    item.assemble(State(unknowns, np.zeros(0), 0.0), sink, found)
    return found, sink


def test_residual_and_tangent_are_derivatives_of_the_energy():
    mesh, contact, unknowns = pressed()
    direction = np.random.default_rng(0).standard_normal(mesh.points.size)
    small = 1e-6
    found, sink = evaluate(contact, unknowns)
    assert found.energy > 0.0
    assert found.min_gap < 0.05
    above, below = (evaluate(contact, unknowns + s * small * direction) for s in (1, -1))
    work = (above[0].energy - below[0].energy) / (2 * small)
    assert sink.residual @ direction == pytest.approx(work, rel=1e-6)
    slope = (above[1].residual - below[1].residual) / (2 * small)
    assert sink.matrix @ direction == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())


def test_forces_on_both_bodies_cancel_and_follow_the_normal_of_the_object():
    mesh, contact, unknowns = pressed(gap=-0.2)
    state = State(0.0 * unknowns, np.zeros(0), 0.0)
    contact.look(state)
    nodal = contact.forces(state)
    assert nodal.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    # The pair of forces acts across the gap, which lies along x: what is oblique leaves a small couple.
    couple = np.cross(mesh.points, nodal).sum(axis=0)
    assert np.abs(couple).max() <= np.abs(contact.gaps).max() * np.abs(nodal[:, 1:]).sum()
    assert couple[0] == pytest.approx(0.0, abs=1e-9)
    # The quarter ball bulges towards +x at y > 0, so the flat wall pushes it back and towards -y.
    force, _ = contact.resultant(state)
    assert force[0] < 0.0
    assert force[1] < 0.0
    assert force[2] == pytest.approx(0.0, abs=1e-6 * abs(force[0]))


def test_nothing_acts_beyond_the_reach_and_the_gap_is_seen():
    mesh, contact, _ = pressed(gap=0.4)
    state = State(np.zeros(mesh.points.size), np.zeros(0), 0.0)
    contact.look(state)
    assert np.abs(contact.forces(state)).max() == 0.0
    assert contact.touch(state).patch == 0.0
    # The sample nearest to the front lies 0.05 mm off its pole, where the ball has fallen by micrometres.
    assert contact.clearance(state, 2.0) == pytest.approx(0.4, abs=0.01)
    assert contact.clearance(state, 0.2) == np.inf


def held(mesh, wall_points):
    across, cut = (mesh.facet_set(f"object_{name}").points for name in ("middle", "cut"))
    return {
        0: np.r_[across, wall_points],
        1: np.r_[cut, np.flatnonzero(np.abs(mesh.points[:, 1]) < 1e-9), wall_points],
        2: wall_points,
    }


def squeezed(mesh, laws, push, steps, barrier):
    """The object with the block pushed onto it by `push`, the block's far face moved; model and contact."""
    blocks = mesh.blocks[0]
    n = int((blocks.region == 0).sum())
    parts = tuple(
        replace(blocks, nodes=blocks.nodes[k], region=blocks.region[k]) for k in (slice(n), slice(n, None))
    )
    mesh = replace(mesh, blocks=parts)
    wall = Solid(mesh, {"*": laws[0]}, 0, "continuous")
    thing = Solid(mesh, {"*": laws[1]}, 1, "continuous", 3 * len(mesh.points) + wall.n_own)
    contact = BodyContact(mesh, ["x_min"], "object_skin", barrier=barrier)
    far = mesh.facet_set("x_max").points
    hold = MeanHold(mesh.facet_set("object_middle").points, 2, 10.0)
    model = Model(mesh, [wall, thing], held(mesh, far), others=[contact, hold])
    state = model.rest()
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        state = state.copy()
        state.unknowns[3 * far] = -share * push
        state = model.solve(state, Control("parameter", 0.0)).state
    return model, contact, thing, state, far


def test_a_stiff_block_compresses_a_soft_box_as_the_closed_form_says():
    """Nominal stress mu (s - 1 / s^2) of a neo-Hookean bar at stretch s, nearly incompressible."""
    box = object_mesh((8.0, 6.0, 6.0), (), 2.0, edge_radius=0.05)
    law = OgdenLaw.elastic(0.03, 0.49)
    barrier = Barrier(reach=0.02, stiffness=10.0, depth=3.0, ahead=4.0)
    mesh = block_before(box, 0.02)
    push = 0.4
    model, contact, _, state, far = squeezed(mesh, (OgdenLaw.elastic(30.0, 0.3), law), push, 4, barrier)
    force, _ = contact.resultant(state)
    touch = contact.touch(state)
    yielded = barrier.reach - float(np.median(contact.gaps[contact.gaps < barrier.reach]))
    stretch = 1.0 - (push - yielded) / 4.0
    nominal = law.mu[0] * (stretch - stretch**-2)
    # Half of the box: 3 x 6 mm of its section; its rounded edges carry less.
    assert -force[0] == pytest.approx(-nominal * 3.0 * 6.0, rel=0.03)
    assert touch.patch == pytest.approx(18.0, rel=0.05)
    assert float((touch.pressure * touch.area).sum()) == pytest.approx(-force[0], rel=0.02)
    # Action and reaction: what the block is pushed with, what the middle plane holds, what the contact says.
    model.evaluate(state, stiff=False)
    nodal = model.system.residual[: mesh.points.size].reshape(-1, 3)
    middle = mesh.facet_set("object_middle").points
    assert nodal[far].sum(axis=0)[0] == pytest.approx(force[0], rel=1e-5)
    assert nodal[middle].sum(axis=0)[0] == pytest.approx(-force[0], rel=1e-5)
    points = contact.point_pressures(state)
    assert points[mesh.facet_set("object_skin").points].max() == pytest.approx(-nominal, rel=0.2)


@pytest.mark.slow
def test_a_ball_presses_a_stiff_block_as_hertz_says():
    """F = 4/3 E / (1 - nu^2) sqrt(R) depth^1.5, depth from the middle of the ball to the block."""
    law = OgdenLaw.elastic(0.03, 0.3)
    radius = 8.0
    barrier = Barrier(reach=0.05, stiffness=2.0, depth=3.0, ahead=4.0)
    ball = object_mesh((2 * radius,) * 3, (0, 1, 2), 2.0)
    mesh = block_before(ball, 0.05, n=4)
    push = 0.4
    _, contact, _, state, _ = squeezed(mesh, (OgdenLaw.elastic(30.0, 0.3), law), push, 8, barrier)
    force, _ = contact.resultant(state)
    hertz = 4.0 / 3.0 * 0.03 / (1 - 0.09) * np.sqrt(radius) * push**1.5
    # Half of the patch is modelled; the ball is squeezed from two sides, each by `push`. Cells as long as the
    # patch's radius and a depth of a twentieth of the ball's radius make it stiffer, by 10 %.
    assert -2.0 * force[0] == pytest.approx(hertz, rel=0.12)
    patch = 2.0 * contact.touch(state).patch
    assert patch == pytest.approx(np.pi * radius * push, rel=0.1)


def test_the_mean_place_is_held_with_the_stated_stiffness():
    hold = MeanHold(np.array([0, 2]), 2, 5.0)
    unknowns = np.zeros(9)
    unknowns[2], unknowns[8] = 0.3, 0.1
    found, sink = evaluate(hold, unknowns)
    assert found.energy == pytest.approx(0.5 * 5.0 * 0.2**2)
    assert sink.residual[[2, 8]] == pytest.approx([0.5, 0.5])
    assert hold.force(State(unknowns, np.zeros(0), 0.0)) == pytest.approx(-1.0)
    assert sink.matrix @ unknowns == pytest.approx(sink.residual)


def test_the_peak_leaves_out_a_share_of_the_touching_area():
    touch = Touch(np.zeros((4, 3)), np.array([0.0, 1.0, 2.0, 9.0]), np.array([1e4, 60.0, 39.5, 0.5]))
    assert touch.patch == 100.0
    assert touch.peak(0.99) == 2.0
    assert touch.peak(1.0) == 9.0
    assert Touch(np.zeros((1, 3)), np.zeros(1), np.ones(1)).peak() == 0.0
