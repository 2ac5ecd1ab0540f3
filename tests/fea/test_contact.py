"""Contact items: exact derivatives, balance of forces and moments, reach, partners, rigid shapes."""

import numpy as np
import pytest
from probe import DenseSink

from tubefoot.errors import ConfigError, GeometryError
from tubefoot.fea.barrier import Barrier
from tubefoot.fea.contact import SelfContact
from tubefoot.fea.elements import element_kind
from tubefoot.fea.fading import placed
from tubefoot.fea.items import Evaluation, State
from tubefoot.fea.mesh import FacetSet, Mesh
from tubefoot.fea.obstacle import Box, Obstacle, Plane, Sphere, mirror_image
from tubefoot.fea.proximity import edge_zones, facet_edges


def patch(kind, height, upward, first):
    """Two by two facets in the plane z = height, normals up or down; node numbers begin at `first`."""
    reference = element_kind(kind).nodes
    if kind == "triangle6":
        corners = [np.array([[0, 0], [1, 0], [0, 1.0]]), np.array([[1, 1], [0, 1], [1, 0.0]])]
        cells = [c[0] + reference @ (c[1:] - c[0]) + [i, j] for i in (0, 1) for j in (0, 1) for c in corners]
    else:
        cells = [reference + np.array([2.0 * i, 2.0 * j]) for i in (0, 1) for j in (0, 1)]
    flat = np.vstack(cells)
    if not upward:
        flat = flat[:, ::-1] + [0.13, 0.21]
    points, numbers = np.unique(np.round(flat, 9), axis=0, return_inverse=True)
    lifted = np.column_stack([points, np.full(len(points), height)])
    return lifted, numbers.reshape(len(cells), -1) + first


def facing(kind, gap):
    lower, below = patch(kind, 0.0, True, 0)
    upper, above = patch(kind, gap, False, len(lower))
    return Mesh(np.vstack([lower, upper]), (), (), {"walls": FacetSet(kind, np.vstack([below, above]))})


def evaluate(item, unknowns):
    sink, found = DenseSink(len(unknowns)), Evaluation()
    item.assemble(State(unknowns, np.zeros(0), 0.0), sink, found)
    return found, sink


def assert_exact_derivatives(item, unknowns, seed=0):
    direction = np.random.default_rng(seed).standard_normal(unknowns.shape)
    small = 3e-7
    _, sink = evaluate(item, unknowns)
    above, below = (evaluate(item, unknowns + s * small * direction) for s in (1, -1))
    work = (above[0].energy - below[0].energy) / (2 * small)
    assert sink.residual @ direction == pytest.approx(work, rel=1e-6)
    slope = (above[1].residual - below[1].residual) / (2 * small)
    assert sink.matrix @ direction == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    assert np.abs(sink.matrix - sink.matrix.T).max() < 1e-12 * np.abs(sink.matrix).max()


@pytest.fixture(params=["quad9", "triangle6", "quad8"])
def pressed(request):
    """Walls that came close from a rest gap of 1 mm, both curved."""
    mesh = facing(request.param, 1.0)
    rng = np.random.default_rng(4)
    displacement = 0.02 * rng.standard_normal(mesh.points.shape)
    displacement[mesh.points[:, 2] > 0.5, 2] -= 0.95
    contact = SelfContact(mesh, ["walls"])
    unknowns = displacement.ravel()
    assert contact.look(State(unknowns, np.zeros(0), 0.0))
    return mesh, contact, unknowns


def test_residual_and_tangent_are_derivatives_of_the_energy(pressed):
    _, contact, unknowns = pressed
    assert_exact_derivatives(contact, unknowns)


def tilted(mesh, degrees):
    """Displacements that turn the upper wall about x and let it cut into the lower one, both curved."""
    rng = np.random.default_rng(7)
    upper = mesh.points[:, 2] > 0.5
    displacement = 0.02 * rng.standard_normal(mesh.points.shape)
    centre = mesh.points[upper].mean(axis=0)
    angle = np.deg2rad(degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    away = mesh.points[upper] - centre
    displacement[upper] += away @ turn.T - away - [0.0, 0.0, 1.0]
    return displacement.ravel()


@pytest.mark.parametrize("kind", ["quad9", "triangle6", "quad8"])
@pytest.mark.parametrize("degrees", [62.0, 68.0, -72.0])
def test_derivatives_are_exact_where_a_contact_seen_edge_on_fades(kind, degrees):
    mesh = facing(kind, 1.0)
    contact = SelfContact(mesh, ["walls"])
    unknowns = tilted(mesh, degrees)
    assert contact.look(State(unknowns, np.zeros(0), 0.0))
    found, sink = evaluate(contact, unknowns)
    assert found.energy > 0.0
    assert_exact_derivatives(contact, unknowns)
    forces = sink.residual.reshape(-1, 3)
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).sum()
    positions = mesh.points + unknowns.reshape(-1, 3)
    assert np.abs(np.cross(positions, forces).sum(axis=0)).max() < 1e-10 * np.abs(forces).sum()


def test_elements_that_no_contact_needs_any_more_are_dropped():
    mesh = facing("quad9", 1.0)
    upper = mesh.points[:, 2] > 0.5

    def looked(contact, *shifts):
        for shift in shifts:
            displacement = np.zeros(mesh.points.shape)
            displacement[upper] = [*shift, -0.95]
            contact.look(State(displacement.ravel(), np.zeros(0), 0.0))
        return contact.pattern

    there, back = (0.0, 2.0), (2.0, 0.0)
    straight = looked(SelfContact(mesh, ["walls"]), back)
    assert len(looked(SelfContact(mesh, ["walls"]), there)) > 0
    assert looked(SelfContact(mesh, ["walls"]), there, back) == pytest.approx(straight)


def test_forces_and_moments_of_both_sides_cancel(pressed):
    mesh, contact, unknowns = pressed
    _, sink = evaluate(contact, unknowns)
    forces = sink.residual.reshape(-1, 3)
    size = np.abs(forces).sum()
    assert size > 0.1
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * size
    positions = mesh.points + unknowns.reshape(-1, 3)
    assert np.abs(np.cross(positions, forces).sum(axis=0)).max() < 1e-10 * size


def test_partners_are_kept_where_nothing_moved(pressed):
    _, contact, unknowns = pressed
    assert not contact.look(State(unknowns, np.zeros(0), 0.0))


def shifted(mesh, gap, sideways):
    """State in which the upper wall is at a gap and moved along x."""
    unknowns = np.zeros(mesh.points.shape)
    unknowns[mesh.points[:, 2] > 0.5] += [sideways, 0.0, gap - 1.0]
    return State(unknowns.ravel(), np.zeros(0), 0.0)


@pytest.mark.parametrize("gap", [0.02, 0.002])
@pytest.mark.parametrize("kind", ["quad9", "triangle6", "quad8"])
def test_sliding_over_the_kinks_between_facets_takes_just_the_energy_that_the_forces_take(kind, gap):
    """Facets opposite change on the way, where the wall has a kink of 23 degrees: no force may jump there."""
    mesh = facing(kind, 1.0)
    rest, upper = mesh.points, mesh.points[:, 2] > 0.5
    middle = (rest[~upper, 0].max() + rest[~upper, 0].min()) / 2
    width = np.ptp(rest[upper, 0])

    def slid(sideways):
        displacement = np.zeros(rest.shape)
        displacement[~upper, 2] = -0.2 * np.abs(rest[~upper, 0] - middle)
        # Its upper side is narrower, so that it slides over no border of the lower one.
        displacement[upper, 1] = -0.5 * (rest[upper, 1] - rest[~upper, 1].mean())
        displacement[upper] += [sideways, 0.0, gap - 1.0]
        return displacement.ravel()

    contact = SelfContact(mesh, ["walls"])
    contact.look(State(slid(0.0), np.zeros(0), 0.0))
    along = np.zeros(rest.shape)
    along[upper, 0] = 1.0
    step = 0.0005 * width
    energies, forces, partners = [], [], set()
    for k in range(401):
        unknowns = slid((k - 200) * step)
        contact.look(State(unknowns, np.zeros(0), 0.0))
        found, sink = evaluate(contact, unknowns)
        energies.append(found.energy)
        forces.append(sink.residual @ along.ravel())
        partners.add(tuple(contact.choice[1]))
    forces = np.array(forces)
    assert len(partners) > 5
    assert np.ptp(forces) > 0.005
    work = 0.5 * step * (forces[1:] + forces[:-1])
    assert np.diff(energies) == pytest.approx(work, abs=2e-3 * step * np.ptp(forces))
    assert np.abs(np.diff(forces)).max() < 0.1 * np.ptp(forces)


@pytest.mark.parametrize("kind", ["quad9", "triangle6", "quad8"])
def test_facets_share_the_zone_around_their_edge(kind):
    """On a line over an edge, away from the corners, the weights of its two facets add up to one."""
    nodes = patch(kind, 0.0, True, 0)
    stretched = nodes[0] * [1.0, 1.0, 0.0]
    stretched[:, 0] += np.maximum(stretched[:, 0] - 1.0, 0.0)
    zones, edges = edge_zones(element_kind(kind), nodes[1], stretched), facet_edges(element_kind(kind))
    corners = element_kind(kind).n_corners
    ends = [{int(f[k]), int(f[(k + 1) % corners])} for f in nodes[1] for k in range(corners)]
    shared = [k for k, pair in enumerate(ends) if ends.count(pair) == 2]
    assert shared
    found, widths = np.empty(6), {}
    for k in shared:
        facet, edge = divmod(k, corners)
        width = zones[facet, edge, 1]
        assert zones[facet, edge, 0] == pytest.approx(-width)
        at = element_kind(kind).nodes[[edge, (edge + 1) % corners]].mean(axis=0)
        out = edges[edge, :2] / (edges[edge, :2] @ edges[edge, :2])
        along = np.array([-edges[edge, 1], edges[edge, 0]])
        places = at + 1e-5 * np.array([0.0 * out, width * out, along])
        middle, aside, tangent = element_kind(kind).shape(places) @ stretched[nodes[1][facet]]
        across = np.linalg.norm(np.cross(aside - middle, tangent - middle)) / np.linalg.norm(tangent - middle)
        widths.setdefault(frozenset(ends[k]), []).append(across / 1e-5)
        for share in (-1.0, -0.4, 0.0, 0.7, 1.0):
            placed(*(at + share * width * out), edges, zones[facet], found)
            here = found[0]
            placed(*(at - share * width * out), edges, zones[facet], found)
            assert here + found[0] == pytest.approx(1.0, abs=1e-12)
            assert (here > 0.5) == (share < 0.0) or share == 0.0
    assert all(one == pytest.approx(other, rel=1e-3) for one, other in widths.values())
    alone = [divmod(k, corners) for k, pair in enumerate(ends) if ends.count(pair) == 1]
    assert all(zones[facet, edge, 0] == 0.0 < zones[facet, edge, 1] for facet, edge in alone)


def test_walls_that_do_not_act_on_each_other_yet_make_no_elements():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    assert not contact.look(shifted(mesh, 0.2, 0.0))
    assert len(contact.pattern) == 0
    assert contact.look(shifted(mesh, 0.05, 0.0))
    assert len(contact.pattern) > 0
    assert not contact.look(shifted(mesh, 0.2, 0.0))
    assert contact.gaps == pytest.approx(0.2)


def test_a_residual_alone_is_that_which_comes_with_the_tangent(pressed):
    _, contact, unknowns = pressed
    _, sink = evaluate(contact, unknowns)
    alone = DenseSink(len(unknowns))
    alone.stiff = False
    contact.assemble(State(unknowns, np.zeros(0), 0.0), alone, Evaluation())
    assert alone.residual == pytest.approx(sink.residual, rel=1e-12, abs=1e-15)
    assert np.abs(sink.residual).max() > 0.0


def test_a_contact_that_did_not_act_and_got_lost_is_forgotten():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(shifted(mesh, 0.05, 0.0))
    contact.look(shifted(mesh, 0.3, 0.0))
    assert len(contact.choice.sample) > 0
    far = shifted(mesh, 0.3, 30.0)
    assert not contact.look(far)
    found, _ = evaluate(contact, far.unknowns)
    assert found.min_gap > 0.0


def test_a_wall_that_came_through_in_one_move_is_a_contact_however_deep():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(shifted(mesh, 0.9, 0.0))
    through = shifted(mesh, -0.4, 0.0)
    contact.look(through)
    found, _ = evaluate(contact, through.unknowns)
    assert found.min_gap == pytest.approx(-0.4)


@pytest.mark.parametrize("gap", [-0.4, -0.02])
def test_a_wall_that_appears_behind_from_the_side_is_seen_around_a_corner(gap):
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    behind = shifted(mesh, gap, 0.3)
    for state in (shifted(mesh, 1.0, 30.0), shifted(mesh, gap, 30.0), behind, behind):
        contact.look(state)
        assert len(contact.gaps) == 0


def test_what_is_seen_around_a_corner_becomes_a_contact_beyond_the_reach_only():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    for state in (shifted(mesh, 1.0, 30.0), shifted(mesh, -0.02, 30.0)):
        contact.look(state)
    # Seen around a corner, then in front of the samples, but within the reach: a force would set in at once.
    for gap in (-0.02, -1e-6, 1e-6, 0.09, -0.05, 0.05):
        state = shifted(mesh, gap, 0.3)
        contact.look(state)
        assert evaluate(contact, state.unknowns)[0].energy == 0.0
    before = contact.choice
    for gap, acts in ((0.11, False), (0.09, True), (-0.02, True)):
        state = shifted(mesh, gap, 0.3)
        contact.look(state)
        assert (evaluate(contact, state.unknowns)[0].energy > 0.0) == acts
    # A step taken back: around the corner again.
    contact.choice = before
    state = shifted(mesh, 0.09, 0.3)
    contact.look(state)
    assert evaluate(contact, state.unknowns)[0].energy == 0.0


def test_a_wall_that_is_pressed_in_stays_a_contact_where_it_slides_to_other_facets():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(shifted(mesh, 0.05, 0.0))
    kind, nodes = element_kind("quad9"), mesh.facet_set("walls").nodes
    samples = (kind.shape(kind.quadrature_points) @ mesh.points[nodes[4:], :2]).reshape(-1, 2)
    centre = mesh.points[mesh.points[:, 2] < 0.5, :2].mean(axis=0)
    for sideways in np.linspace(0.0, 1.5, 7):
        state = shifted(mesh, -0.02, sideways)
        contact.look(state)
        assert contact.gaps == pytest.approx(-0.02)
        assert evaluate(contact, state.unknowns)[0].energy > 0.0
        over = (np.abs(samples + np.array([sideways, 0.0]) - centre) < 2.0).all(axis=1)
        assert np.isin(len(samples) + np.flatnonzero(over), contact.choice.sample).all()


def test_where_a_wall_stood_is_taken_back_with_the_contacts():
    mesh = facing("quad9", 1.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(shifted(mesh, 0.9, 0.0))
    before = contact.choice
    contact.look(shifted(mesh, -0.4, 30.0))
    contact.choice = before
    contact.look(shifted(mesh, -0.4, 0.0))
    assert contact.gaps.min() == pytest.approx(-0.4)


def test_without_their_negative_eigenvalues_contacts_only_resist(pressed):
    _, contact, unknowns = pressed
    _, exact = evaluate(contact, unknowns)
    contact.convex = True
    _, convex = evaluate(contact, unknowns)
    largest = np.abs(exact.matrix).max()
    assert np.linalg.eigvalsh(exact.matrix).min() < -1e-3 * largest
    assert np.linalg.eigvalsh(convex.matrix).min() > -1e-12 * largest
    assert np.linalg.eigvalsh(convex.matrix - exact.matrix).min() > -1e-12 * largest
    assert convex.residual == pytest.approx(exact.residual, rel=1e-9)


def test_a_tilted_wall_is_held_off_by_its_distance_from_the_plane_opposite():
    mesh = facing("quad9", 1.0)
    lower = mesh.points[:, 2] < 0.5
    wide = mesh.points.copy()
    wide[lower, :2] = 1.0 + 3.0 * (wide[lower, :2] - 1.0)
    mesh = Mesh(wide, (), (), mesh.facets)
    barrier = Barrier(reach=0.4, stiffness=3.0, depth=2.0)
    contact = SelfContact(mesh, ["walls"], barrier)
    n_lower = len(contact.areas) // 2
    contact.areas[:n_lower] = 0.0
    centre = mesh.points[~lower].mean(axis=0)
    angle = np.deg2rad(30.0)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    turned = (mesh.points[~lower] - centre) @ turn.T + centre - [0.0, 0.0, 0.9]
    unknowns = np.zeros(mesh.points.shape)
    unknowns[~lower] = turned - mesh.points[~lower]
    contact.look(State(unknowns.ravel(), np.zeros(0), 0.0))
    found, sink = evaluate(contact, unknowns.ravel())
    samples = contact._sampled(mesh.points + unknowns)[n_lower:]
    pressure = barrier.pressure(samples[:, 2])
    assert samples[:, 2].min() < -0.7
    excess = np.maximum(0.0, 0.4 - samples[:, 2])
    assert found.energy == pytest.approx(contact.areas[n_lower:] @ (3.0 / 1.2 * excess**3), rel=1e-9)
    # The wall opposite is flat, so it pushes straight away from itself.
    force = -sink.residual.reshape(-1, 3)[~lower].sum(axis=0)
    assert force == pytest.approx([0.0, 0.0, contact.areas[n_lower:] @ pressure], abs=1e-9 * force[2])


@pytest.mark.parametrize("gap", [0.09, 0.03, -0.02])
def test_pressure_is_that_of_the_barrier_and_acts_within_the_reach_only(gap):
    barrier = Barrier(reach=0.1, stiffness=3.0)
    mesh = facing("quad9", 1.0)
    # The upper wall lies wholly over the lower one, which is wider.
    lower = mesh.points[:, 2] < 0.5
    wide = mesh.points.copy()
    wide[lower, :2] = 1.0 + 2.0 * (wide[lower, :2] - 1.0)
    mesh = Mesh(wide, (), (), mesh.facets)
    contact = SelfContact(mesh, ["walls"], barrier)
    unknowns = np.zeros(mesh.points.shape)
    unknowns[~lower, 2] = gap - 1.0
    contact.look(State(unknowns.ravel(), np.zeros(0), 0.0))
    _, sink = evaluate(contact, unknowns.ravel())
    upper_force = -sink.residual.reshape(-1, 3)[~lower].sum(axis=0)
    # Half of the pressure comes from the upper wall's own samples, the other from those below it: 4 x 4 mm.
    expected = 16.0 * 3.0 / 0.1 * (0.1 - gap) ** 2
    assert upper_force[2] == pytest.approx(expected, rel=0.06)
    unknowns[~lower, 2] = 0.1000001 - 1.0
    contact.look(State(unknowns.ravel(), np.zeros(0), 0.0))
    found, sink = evaluate(contact, unknowns.ravel())
    assert found.energy == 0.0
    assert np.abs(sink.residual).max() == 0.0


def test_the_smallest_gap_is_named_and_a_gap_at_rest_bounds_the_reach():
    mesh = facing("quad9", 0.15)
    contact = SelfContact(mesh, ["walls"], Barrier(reach=0.1))
    assert contact.barrier.reach == pytest.approx(0.075)
    rest = State(np.zeros(mesh.points.size), np.zeros(0), 0.0)
    gap, where = contact.smallest_gap(rest, 1.0)
    assert gap == pytest.approx(0.15)
    assert where == "walls"
    assert contact.smallest_gap(rest, 0.1)[0] == np.inf


def test_walls_that_touch_at_rest_are_an_error():
    with pytest.raises(GeometryError, match=r"walls touch at rest.*0\.01 mm"):
        SelfContact(facing("quad9", 0.005), ["walls"])


def test_facets_of_two_kinds_are_an_error():
    mesh = facing("quad9", 1.0)
    both = {**mesh.facets, "other": FacetSet("quad8", mesh.facets["walls"].nodes[:, :8])}
    with pytest.raises(ConfigError, match="several kinds"):
        SelfContact(Mesh(mesh.points, (), (), both), ["walls", "other"])


TURNED = ((0.6, 0.8, 0.0), (-0.8, 0.6, 0.0), (0.0, 0.0, 1.0))
SHAPES = {
    "plane": Plane((0, 0, 0.05), (0.1, -0.2, -2.0)),
    "sphere": Sphere((1.3, 1.1, 3.05), 3.0),
    "box face": Box((1.0, 1.0, 2.04), (1.0, 8.0, 4.0), 0.3, TURNED),
    "box edge": Box((2.5, 2.0, 0.85), (2.0, 1.2, 2.0), 0.9 * 0.6, TURNED),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_rigid_body_presses_with_exact_derivatives_and_its_force_balances_the_wall(name):
    points, nodes = patch("quad9", 0.0, True, 0)
    mesh = Mesh(points, (), (), {"wall": FacetSet("quad9", nodes)})
    obstacle = Obstacle(mesh, "wall", SHAPES[name])
    unknowns = 0.02 * np.random.default_rng(2).standard_normal(points.size)
    assert_exact_derivatives(obstacle, unknowns)
    _, sink = evaluate(obstacle, unknowns)
    forces = sink.residual.reshape(-1, 3)
    assert np.linalg.norm(obstacle.force) > 1e-3
    assert obstacle.force == pytest.approx(forces.sum(axis=0), abs=1e-12)
    moment = np.cross(points + unknowns.reshape(-1, 3), forces).sum(axis=0)
    assert obstacle.moment == pytest.approx(moment, abs=1e-10)


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_distances_have_their_derivatives(shape):
    points = np.random.default_rng(1).uniform(-1.5, 3.5, (200, 3))
    distance, normal, curved = shape.distance(points)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    small = 1e-6
    for axis in range(3):
        moved = small * np.eye(3)[axis]
        above, below = shape.distance(points + moved), shape.distance(points - moved)
        # The inside of a box has edges where the nearest face changes.
        smooth = np.abs(above[1] - below[1]).max(axis=1) < 0.1
        assert smooth.mean() > 0.9
        slope = (above[0] - below[0]) / (2 * small)
        assert slope[smooth] == pytest.approx(normal[smooth, axis], abs=1e-6)
        turning = (above[1] - below[1]) / (2 * small)
        assert turning[smooth] == pytest.approx(
            curved[smooth][:, axis], abs=1e-4 * np.abs(curved).max() + 1e-7
        )
    assert distance.min() < 0 < distance.max()


def test_a_box_without_rounding_is_an_error():
    with pytest.raises(ConfigError, match=r"rounding = 0 mm must be above 0 and at most half .*0\.5 mm"):
        Box((0, 0, 0), (1, 2, 3), 0.0)
    with pytest.raises(ConfigError, match="orthonormal"):
        Box((0, 0, 0), (1, 2, 3), 0.1, ((1, 0, 0), (0, 1, 0), (0, 1, 1)))


def at(mesh, heights):
    """The state in which each point has been lifted to the height given for its rest height."""
    displacement = np.zeros(mesh.points.shape)
    for rest, lifted in heights.items():
        displacement[np.isclose(mesh.points[:, 2], rest), 2] = lifted - rest
    return State(displacement.ravel(), np.zeros(0), 0.0)


def test_walls_that_were_far_apart_are_found_once_they_have_come_close():
    mesh = facing("quad9", 3.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(at(mesh, {3.0: 2.5}))
    assert len(contact.gaps) == 0
    assert contact.look(at(mesh, {3.0: 0.05}))
    assert contact.gaps == pytest.approx(0.05)


def test_partners_are_not_kept_when_another_wall_has_taken_their_place():
    lower, below = patch("quad9", 0.0, True, 0)
    first, above = patch("quad9", 1.0, False, len(lower))
    second, beyond = patch("quad9", 2.0, False, 2 * len(lower))
    facets = {"walls": FacetSet("quad9", np.vstack([below, above, beyond]))}
    mesh = Mesh(np.vstack([lower, first, second]), (), (), facets)
    contact = SelfContact(mesh, ["walls"])
    near = at(mesh, {1.0: 0.05})
    assert contact.look(near)
    evaluate(contact, near.unknowns)
    swapped = at(mesh, {1.0: 2.0, 2.0: 0.05})
    evaluate(contact, swapped.unknowns)
    assert contact.look(swapped)
    found, _ = evaluate(contact, swapped.unknowns)
    assert found.min_gap == pytest.approx(0.05)


def test_contacts_given_back_have_the_elements_that_they_had():
    mesh = facing("quad9", 3.0)
    contact = SelfContact(mesh, ["walls"])
    contact.look(at(mesh, {3.0: 2.5}))
    pattern, before = contact.pattern, contact.choice
    contact.look(at(mesh, {3.0: 0.05}))
    assert contact.pattern is not pattern
    contact.choice = before
    assert contact.pattern is pattern
    assert len(contact.gaps) == 0


def test_a_wall_is_held_off_its_mirror_image_by_the_pressure_of_the_whole_gap():
    points, cells = patch("quad9", 0.0, True, 0)
    mesh = Mesh(points[:, [0, 2, 1]] + [0.0, 1.0, 0.0], (), (), {"lid": FacetSet("quad9", cells)})
    barrier = Barrier()
    image = mirror_image(mesh, "lid", barrier)
    for y in (0.06, 0.045, 0.02, -0.01):
        unknowns = np.zeros(mesh.points.shape)
        unknowns[:, 1] = y - 1.0
        _, sink = evaluate(image, unknowns.ravel())
        force = -sink.residual.reshape(-1, 3).sum(axis=0)
        pressure = barrier.pressure(np.array([2.0 * y]))[0]
        assert force == pytest.approx([0.0, 16.0 * pressure, 0.0], abs=1e-12)
    assert_exact_derivatives(image, unknowns.ravel())


def test_the_reach_of_a_mirror_image_is_at_most_half_the_distance_at_rest():
    points, cells = patch("quad9", 0.0, True, 0)
    mesh = Mesh(points[:, [0, 2, 1]] + [0.0, 0.04, 0.0], (), (), {"lid": FacetSet("quad9", cells)})
    found, _ = evaluate(mirror_image(mesh, "lid", Barrier()), np.zeros(mesh.points.size))
    assert found.energy == 0.0
    assert found.min_gap == pytest.approx(0.04)
