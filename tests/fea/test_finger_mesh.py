"""Finger meshes against closed forms: volumes, closure, facet sets, regions, symmetry, random designs."""

import numpy as np
import pytest

from mapped_box import outer_faces
from tubefoot.design.finger import FingerDesign
from tubefoot.design.profile import Profile, chamber_rest_volume
from tubefoot.errors import GeometryError
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.elements import element_kind
from tubefoot.fea.finger_mesh import REGIONS, clamp_half_finger, finger_mesh, mirror_points
from tubefoot.fea.mesh import jacobian_at, scaled_jacobian
from tubefoot.fea.profile_mesh import Divisions, mesh_profile

UNIONS = {"cavity_right", "cavity_left", "outside"}


def cell_volumes(mesh):
    block = mesh.blocks[0]
    kind = block.element
    return np.linalg.det(jacobian_at(mesh.points, block, kind.quadrature_points)) @ kind.quadrature_weights


def solid_volume(p: Profile) -> float:
    """Half of the finger's body, y >= 0, without fillets: outline times height, less both half chambers."""
    unit = 2 * (p.pitch * p.valley_outside + (p.crest_outside - p.valley_outside) * (p.crest_flat + p.rise))
    outline = p.units * unit + 2 * p.cap * 2 * p.valley_outside
    return outline * p.height / 2 - chamber_rest_volume(p)


def area_vector(mesh, name):
    facets = mesh.facet_set(name)
    kind = element_kind(facets.kind)
    slope = kind.shape_gradient(kind.quadrature_points)
    tangents = np.einsum("fai,qas->fqsi", mesh.points[facets.nodes], slope)
    return np.einsum("fqi,q->i", np.cross(tangents[:, :, 0], tangents[:, :, 1]), kind.quadrature_weights)


@pytest.fixture(scope="module", params=[1, 2, 3])
def finger(request, reference):
    profile = reference.with_bellows(units=request.param).profile
    return profile, finger_mesh(profile, 3.0)


def test_cavities_hold_the_closed_form_volume(finger):
    profile, mesh = finger
    for hand in ("right", "left"):
        half = Cavity(mesh, f"cavity_{hand}", 0).volume
        assert half == pytest.approx(chamber_rest_volume(profile) / 2, rel=1e-9)


def test_cells_fill_the_closed_form_volume(finger):
    profile, mesh = finger
    assert cell_volumes(mesh).sum() == pytest.approx(solid_volume(profile), rel=1e-9)


def test_volumes_converge_to_the_closed_form_with_fillets(reference):
    """Arcs are parabolas here: the chamber with fillets is met to 1e-4 on the coarsest mesh."""
    profile = reference.with_bellows(units=1, fillet_chamber_mm=0.5, fillet_outside_mm=0.4).profile
    errors = []
    for divisions in (Divisions.of(profile, 3.0), Divisions.of(profile, 3.0).refined(2)):
        mesh = finger_mesh(profile, divisions=divisions)
        half = Cavity(mesh, "cavity_left", 0).volume
        errors.append(abs(half / (chamber_rest_volume(profile) / 2) - 1))
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 3


def test_each_cavity_is_closed_by_the_mid_plane(finger):
    profile, mesh = finger
    section = chamber_rest_volume(profile) / (profile.height - 2 * profile.side_wall)
    for hand in ("right", "left"):
        # Normals point into the fluid: what is missing is the section in the plane y = 0.
        expected = [0.0, -section, 0.0]
        assert area_vector(mesh, f"cavity_{hand}") == pytest.approx(expected, abs=1e-9 * section)


def test_the_whole_surface_is_closed(finger):
    _, mesh = finger
    total = sum(area_vector(mesh, name) for name in mesh.facets if name not in UNIONS)
    assert total == pytest.approx(np.zeros(3), abs=1e-9)


def test_every_outer_face_lies_in_exactly_one_primitive_set(finger):
    _, mesh = finger
    named = np.vstack([facets.nodes for name, facets in mesh.facets.items() if name not in UNIONS])
    outer = outer_faces(mesh.blocks[0])
    assert len(named) == len(outer)
    as_rows = [np.unique(np.sort(faces, axis=1), axis=0) for faces in (named, outer)]
    assert as_rows[0].shape == as_rows[1].shape
    assert (as_rows[0] == as_rows[1]).all()


def test_named_sets_lie_where_their_names_say(finger):
    p, mesh = finger

    def span(name, axis):
        along = mesh.points[mesh.facet_set(name).points, axis]
        return along.min(), along.max()

    length = p.bellows_length
    assert span("base", 2) == pytest.approx((-p.cap, -p.cap), abs=1e-9)
    assert span("tip", 2) == pytest.approx((length + p.cap, length + p.cap), abs=1e-9)
    assert span("mid_plane", 1) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert span("side", 1) == pytest.approx((p.height / 2, p.height / 2), abs=1e-9)
    assert span("lid_right", 1) == pytest.approx((p.height / 2 - p.side_wall,) * 2, abs=1e-9)
    assert span("crest_outside_right", 0) == pytest.approx((p.crest_outside,) * 2, abs=1e-9)
    assert span("crest_inside_left", 0) == pytest.approx((-p.slot_end,) * 2, abs=1e-9)
    assert span("partition_inside_right", 0) == pytest.approx((p.partition_face,) * 2, abs=1e-9)
    assert span("valley_outside_left", 0) == pytest.approx((-p.valley_outside,) * 2, abs=1e-9)
    assert span("flank_outside_right", 0) == pytest.approx((p.valley_outside, p.crest_outside), abs=1e-9)
    held = clamp_half_finger(mesh)
    assert set(held) == {0, 1, 2}
    assert len(held[1]) > len(held[0])


def test_regions_have_the_volumes_of_their_parts(finger):
    p, mesh = finger
    by_region = dict.fromkeys(REGIONS, 0.0)
    for region, volume in zip(mesh.blocks[0].region, cell_volumes(mesh), strict=True):
        by_region[REGIONS[region]] += volume
    assert by_region["cap"] == pytest.approx(2 * p.cap * 2 * p.valley_outside * p.height / 2, rel=1e-9)
    open_half = p.height / 2 - p.side_wall
    assert by_region["partition"] == pytest.approx(p.partition * p.bellows_length * open_half, rel=1e-9)
    assert by_region["fold_right"] == pytest.approx(by_region["fold_left"], rel=1e-9)
    outline = solid_volume(p) + chamber_rest_volume(p)
    side = (outline - by_region["cap"]) * p.side_wall / (p.height / 2)
    assert by_region["side_wall"] == pytest.approx(side, rel=1e-9)


def test_mirror_points_are_an_involution_that_keeps_y_and_z(finger):
    _, mesh = finger
    mirror = mirror_points(mesh)
    assert (mirror[mirror] == np.arange(len(mesh.points))).all()
    assert mesh.points[mirror] == pytest.approx(mesh.points * [-1.0, 1.0, 1.0], abs=1e-6)


def test_cells_are_no_longer_than_the_element_size_and_refinement_divides_them(reference):
    profile = reference.profile
    size = 1.5
    mesh = finger_mesh(profile, size)
    layers = np.unique(np.round(mesh.points[:, 1], 9))
    assert len(layers) - 1 == 2 * int(
        np.ceil((profile.height / 2 - profile.side_wall) / size) + np.ceil(profile.side_wall / size)
    )
    coarse = Divisions.of(profile, 3.0)
    cells = [len(mesh_profile(profile, d).cells) for d in (coarse, coarse.refined(2))]
    assert cells[1] == 4 * cells[0]


def random_bellows(rng):
    def between(low, high):
        return round(float(rng.uniform(low, high)), 3)

    return {
        "units": int(rng.integers(1, 4)),
        "fold_run_mm": between(2.5, 8.0),
        "fold_rise_mm": between(0.0, 1.5),
        "crest_flat_mm": between(3.5, 7.0),
        "valley_flat_mm": between(0.6, 2.5),
        "fold_wall_mm": between(0.9, 1.9),
        "valley_wall_mm": between(0.9, 2.5),
        "partition_mm": between(0.9, 3.5),
        "chamber_gap_mm": between(2.0, 5.0),
        "height_mm": between(6.0, 14.0),
        "side_wall_mm": between(0.6, 2.0),
        "cap_mm": between(2.5, 6.0),
        "fillet_outside_mm": float(rng.choice([0.0, between(0.05, 0.5)])),
        "fillet_chamber_mm": float(rng.choice([0.0, between(0.05, 0.5)])),
    }


def test_random_valid_designs_mesh_with_sound_cells_and_the_right_volumes(reference):
    rng = np.random.default_rng(20)
    meshed = 0
    while meshed < 25:
        try:
            settings = {**reference.model_dump(), "bellows": random_bellows(rng)}
            profile = FingerDesign.model_validate(settings).profile
        except GeometryError:
            continue
        mesh = finger_mesh(profile, float(rng.uniform(1.5, 4.0)))
        meshed += 1
        assert scaled_jacobian(mesh).min() > 0.05
        plain = profile.fillet_outside == profile.fillet_chamber == 0
        half = Cavity(mesh, "cavity_right", 0).volume
        assert half == pytest.approx(chamber_rest_volume(profile) / 2, rel=1e-9 if plain else 2e-3)
        if plain:
            assert cell_volumes(mesh).sum() == pytest.approx(solid_volume(profile), rel=1e-9)
        assert len(outer_faces(mesh.blocks[0])) == sum(
            len(facets.nodes) for name, facets in mesh.facets.items() if name not in UNIONS
        )
