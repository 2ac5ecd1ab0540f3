"""The bond plane: forces against the fluid's, the stress field against the reactions, symmetry."""

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from mapped_box import mapped_box
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.elements import element_kind
from tubefoot.fea.finger_model import SolveSettings, build_finger
from tubefoot.fea.measures import PAPER_AXES
from tubefoot.fea.mesh import FacetSet
from tubefoot.fea.path import follow
from tubefoot.fea.seam import FaceCells, Seam, SeamState, hand_weights, seam_rows, support_forces
from tubefoot.fea.solid import OgdenLaw, Solid
from tubefoot.fea.stride import StepControl

FINGER = FingerDesign().with_bellows(units=1)


def solved(design=FINGER, size=3.5, **keys):
    settings = SolveSettings(element_size_mm=size, **{"target": 12.0, **keys})
    finger = build_finger(design, settings)
    state = follow(finger.model, finger.goal, stepping=StepControl(states=2)).steps[-1].state
    return finger, state


@pytest.fixture(scope="module")
def ideal():
    return solved()


@pytest.fixture(scope="module")
def rows(ideal):
    finger, state = ideal
    seam = Seam(finger.mesh, finger.solid)
    return {row["place"]: row for row in seam_rows(3, seam, seam.read(finger.model, state), 0.1)}


def opening(mesh, wall, unknowns):
    """Area of a chamber's opening in the deformed mid-plane, from the rim of its wall alone."""
    facets = mesh.facet_set(wall).nodes
    edges = np.vstack([facets[:, [a, b, m]] for a, b, m in ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    rim = edges[first[count == 1]]
    now = (mesh.points + unknowns[: mesh.points.size].reshape(-1, 3))[rim]
    assert np.abs(now[..., 1]).max() < 1e-12
    points, weights = leggauss(3)
    total = 0.0
    for s, w in zip(points, weights, strict=True):
        shape = np.array([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s * s])
        slope = np.array([s - 0.5, s + 0.5, -2 * s])
        x, z = np.einsum("a,eai->ie", shape, now[..., [0, 2]])
        dx, dz = np.einsum("a,eai->ie", slope, now[..., [0, 2]])
        total += 0.5 * w * (x * dz - z * dx).sum()
    return abs(total)


def wall_moment(mesh, wall, now):
    """Moment of a unit pressure on a wall, by splitting each facet into four flat pieces five times."""
    kind = element_kind("quad9")
    line = np.linspace(-1, 1, 65)
    s, t = np.meshgrid(line, line, indexing="ij")
    shape = kind.shape(np.column_stack([s.ravel(), t.ravel()]))
    points = np.einsum("qa,fai->fqi", shape, now[mesh.facet_set(wall).nodes])
    grid = points.reshape(len(points), 65, 65, 3)
    a, b, c, d = grid[:, :-1, :-1], grid[:, 1:, :-1], grid[:, 1:, 1:], grid[:, :-1, 1:]
    area = -0.5 * np.cross(c - a, d - b)
    return np.cross((a + b + c + d) / 4, area).sum(axis=(0, 1, 2))


def test_seam_and_base_bear_what_the_fluids_push(ideal, rows):
    finger, state = ideal
    base = finger.mesh.facet_set("base").points
    on_base = -support_forces(finger.model, state)[base, 1].sum()
    pushed = sum(
        p * opening(finger.mesh, f"cavity_{hand}", state.unknowns)
        for p, hand in zip(state.pressures, ("right", "left"), strict=True)
    )
    force = rows["all"]["opening_force_n"]
    assert force + on_base == pytest.approx(pushed, rel=1e-6)
    largest = max(abs(rows[hand]["opening_force_n"]) for hand in ("right", "left"))
    assert abs(on_base) < 0.2 * largest


def test_moments_balance_too(ideal):
    """Moments of the supports' forces against those of the fluids' push on their walls, about all axes."""
    finger, state = ideal
    n = finger.mesh.points.size
    now = finger.mesh.points + state.unknowns[:n].reshape(-1, 3)
    held = np.cross(now, support_forces(finger.model, state)).sum(axis=0)
    pushed = np.zeros(3)
    for pressure, hand in zip(state.pressures, ("right", "left"), strict=True):
        pushed += pressure * wall_moment(finger.mesh, f"cavity_{hand}", now)
    # The flat pieces leave 3e-6.
    assert np.abs(held + pushed).max() < 1e-5 * np.abs(pushed).max()


def test_regions_and_sides_sum_to_the_whole(rows):
    regions = [row for place, row in rows.items() if place not in ("all", "right", "left")]
    for column in ("opening_force_n", "area_mm2"):
        whole = rows["all"][column]
        assert sum(row[column] for row in regions) == pytest.approx(whole, rel=1e-9), column
        assert rows["right"][column] + rows["left"][column] == pytest.approx(whole, rel=1e-9), column


def test_pressure_opens_its_side_and_suction_closes_the_other(rows):
    assert rows["right"]["opening_force_n"] > 0 > rows["left"]["opening_force_n"]
    assert rows["right"]["peeling_moment_n_mm"] > rows["left"]["peeling_moment_n_mm"]
    arm = rows["right"]["peeling_moment_n_mm"] / rows["right"]["opening_force_n"]
    assert 0 < arm < FINGER.profile.crest_outside


def test_margin_is_strength_over_the_pull(rows):
    row = rows["right"]
    assert row["bond_margin"] == pytest.approx(100.0 / row["s33_p99_kpa"], rel=1e-12)
    assert row["s33_min_kpa"] <= row["s33_mean_kpa"] <= row["s33_p99_kpa"] <= row["s33_max_kpa"]


def test_without_a_strength_there_is_no_margin(ideal):
    finger, state = ideal
    seam = Seam(finger.mesh, finger.solid)
    found = seam.read(finger.model, state)
    assert all(row["bond_margin"] is None for row in seam_rows(0, seam, found, None))


def test_stress_across_the_plane_sums_to_the_reactions():
    """Two readings of one force: their difference falls with the mesh."""
    differences = []
    for size in (3.5, 1.5):
        finger, state = solved(size=size, target=6.0)
        seam = Seam(finger.mesh, finger.solid)
        found = seam.read(finger.model, state)
        # Nanson: the plane stays plane, so its area grows by the stretch of the facets.
        moved = finger.mesh.points + state.unknowns[: finger.mesh.points.size].reshape(-1, 3)
        now = seam.areas(moved)
        right = hand_weights(seam.places[..., 0], "right")
        by_stress = (found.traction["s33"] * now * right).sum()
        by_force = (hand_weights(seam.force_places[..., 0], "right") * seam.pull(found)).sum()
        differences.append(abs(by_stress / by_force - 1.0))
    assert differences[1] < 0.6 * differences[0]
    assert differences[1] < 0.05


def test_no_shear_on_the_plane_of_an_ideal_seam_but_under_a_film():
    """By symmetry the ideal seam's vanishes: what the mesh leaves of it is a tenth of what a film brings."""
    shears = {}
    for modulus in (0.0, 200.0):
        seam_settings = {"thickness_mm": 0.15, "modulus_mpa": modulus}
        design = FingerDesign.model_validate({"bellows": FINGER.bellows, "seam": seam_settings})
        finger, state = solved(design, size=2.0)
        seam = Seam(finger.mesh, finger.solid)
        whole = seam_rows(0, seam, seam.read(finger.model, state), None)[0]
        shears[modulus] = np.array([whole["s13_p99_kpa"], whole["s23_p99_kpa"]])
    assert (shears[200.0] > 5 * shears[0.0]).all(), shears


@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron20", "tetra10"])
def test_the_pull_comes_back_from_nodal_forces(kind):
    """Forces of a known traction, spread over the plane again: whole and half within what the kind allows."""
    mesh = mapped_box(kind, (3, 1, 2), lambda p: (p - [0.5, 0.0, 0.0]) * [2.0, 1.0, 3.0])
    mesh.facets["mid_plane"], mesh.facets["base"] = (
        mesh.facets["y_min"],
        FacetSet("quad9", np.zeros((0, 9), int)),
    )
    solid = Solid(mesh, {"*": OgdenLaw((1.0,), (2.0,), 50.0)}, pressure="none")
    seam = Seam(mesh, solid)
    facets = mesh.facet_set("y_min")
    face = element_kind(facets.kind)
    shape = face.shape(face.quadrature_points)
    traction = 1.0 + 2.0 * seam.places[..., 0]
    forces = np.zeros(len(mesh.points))
    np.add.at(
        forces,
        FaceCells.of(mesh, solid, "y_min").nodes,
        np.einsum("fq,qa->fa", traction * seam.weights, shape),
    )
    found = SeamState(dict.fromkeys(PAPER_AXES, 0.0 * traction), forces[seam.points])
    pull = seam.pull(found)
    assert pull.sum() == pytest.approx(6.0, rel=1e-12)
    right = (hand_weights(seam.force_places[..., 0], "right") * pull).sum()
    # int over 0 < x < 1 and the width 3 of 1 + 2 x; triangles and eight nodes spread forces over a facet.
    assert right == pytest.approx(6.0, rel=1e-12 if kind == "hexahedron27" else 0.06)

    if kind == "hexahedron27":
        rows = {row["place"]: row for row in seam_rows(0, seam, found, None)}
        # int over 0 < |x| < 1 and the width 3 of (1 +- 2 |x|) (1 - |x|).
        assert rows["right"]["peeling_moment_n_mm"] == pytest.approx(2.5, rel=1e-12)
        assert rows["left"]["peeling_moment_n_mm"] == pytest.approx(0.5, rel=1e-12)


def test_faces_are_found_under_any_numbering_of_their_corners(ideal):
    finger, _ = ideal
    faces = FaceCells.of(finger.mesh, finger.solid, "mid_plane")
    original = finger.mesh.facet_set("mid_plane").nodes
    assert (np.sort(faces.nodes, axis=1) == np.sort(original, axis=1)).all()
    assert (faces.nodes[:, 8] == original[:, 8]).all()
