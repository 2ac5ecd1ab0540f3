"""Solids against closed forms and each other: volumes, fits, contact without overlap, growth."""

from math import pi

import numpy as np
import pytest

from tubefoot.design import cad, solids
from tubefoot.design.bill import bill_of_materials, bond_area
from tubefoot.design.finger import FingerDesign
from tubefoot.design.layout import lip_of, marker_plate_of, tube_axis
from tubefoot.design.outline import silhouette
from tubefoot.design.parts import finger_parts, laid_meshes
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.errors import GeometryError


@pytest.fixture(scope="module")
def compensated(rounded):
    return {part.name: part for part in finger_parts(rounded, growth=0.15)}


@pytest.mark.parametrize("name", ["reference", "rounded"])
def test_whole_body_and_fluid_have_the_volumes_of_the_outlines(name, request):
    design = request.getfixturevalue(name)
    p = design.profile
    fluid = chamber_rest_volume(p)
    solid = silhouette(p).area() * p.height - 2 * fluid
    body = solids.whole_body(design)
    assert cad.volume(body) == pytest.approx(solid, rel=1e-9)
    assert cad.volume(solids.chamber_fluid(design)) == pytest.approx(fluid, rel=1e-9)
    low, high = cad.triangulated(body).bounds
    assert high - low == pytest.approx(p.envelope)


def test_the_modules_are_the_body_with_sockets_pads_lip_and_holes(reference, parts):
    p, r = reference.profile, reference.registration
    tube, pin = reference.ports.outer_diameter_mm / 2, r.pin_diameter_mm / 2
    half = (silhouette(p).area() * p.height - 2 * chamber_rest_volume(p)) / 2
    half -= 4 * pi * tube**2 / 2 * p.cap
    lip, seats = lip_of(reference), reference.marker_seats
    hole = pi * (pin + r.clearance_mm) ** 2 * (r.pin_height_mm + 2 * r.clearance_mm)
    groove = (
        (lip.width + 2 * r.clearance_mm)
        * (lip.height + r.clearance_mm)
        * (p.bellows_length + 2 * r.clearance_mm)
    )
    pads = (
        seats.pad_width_mm * seats.pad_length_mm * seats.pad_height_mm * len(marker_plate_of(reference).units)
    )
    assert parts["front body"].volume == pytest.approx(half - 2 * hole - groove + pads, rel=1e-9)
    ridge = lip.width * lip.height * p.bellows_length
    assert parts["back body"].volume == pytest.approx(
        half - 2 * pi * pin**2 * r.pin_height_mm + ridge, rel=1e-9
    )


PAIRS = [
    ("front body", "back body"),
    ("front body", "front tubes"),
    ("back body", "back tubes"),
    ("front tubes", "back tubes"),
    ("front body", "back tubes"),
    ("front body", "base"),
    ("front tubes", "base"),
    ("front body", "marker plate"),
    ("base", "marker plate"),
]


@pytest.mark.parametrize("pair", PAIRS)
def test_assembled_parts_do_not_overlap(parts, pair):
    first, second = (parts[name].solid for name in pair)
    common = cad.grouped(first.intersect(second) or [])
    assert common is None or not cad.bodies(common) or cad.volume(common) < 1e-9


def test_pins_and_lip_cross_the_bonding_face_and_nothing_else_does(parts):
    for name, reach in (("back body", 0.5), ("back tubes", 1.5), ("front body", 0.0), ("front tubes", 0.0)):
        low, high = parts[name].mesh.bounds
        beyond = -low[1] if name.startswith("back") else high[1]
        assert beyond == pytest.approx(reach, abs=1e-9), name


def test_each_chamber_is_open_from_bottom_tube_to_top_tube(reference, parts):
    from tubefoot.design.raycast import crossings
    from tubefoot.design.surface import TriangleMesh

    everything = TriangleMesh.together(
        [parts[n].mesh for n in ("front body", "back body", "front tubes", "back tubes")]
    )
    axis = tube_axis(reference.profile, reference.ports)
    for x in (-axis, axis):
        # Off the bonding face, which both halves of the tube share.
        along, _ = crossings(everything, np.array([x, 0.3, -30.0]), np.array([0.0, 0.0, 1.0]))
        assert len(along) == 0
    assert len(crossings(everything, np.array([0.0, 0.3, -30.0]), np.array([0.0, 0.0, 1.0]))[0]) > 0


def test_every_mesh_is_closed_and_near_its_solid(parts):
    import build123d as b3d

    for part in parts.values():
        mesh = part.mesh
        assert mesh.open_edges() == 0, part.name
        assert mesh.volume == pytest.approx(part.volume, rel=4e-3), part.name
        centres = mesh.corners.mean(axis=1)
        farthest = max(
            part.solid.distance_to(b3d.Vertex(*point)) for point in centres[:: max(1, len(centres) // 60)]
        )
        assert farthest < 0.02, part.name


def test_growth_moves_every_free_face_inwards(rounded, compensated):
    g = 0.15
    low, high = compensated["back body"].mesh.bounds
    p = rounded.profile
    assert high == pytest.approx([p.crest_outside - g, p.height / 2 - g, p.bellows_length + p.cap - g])
    assert low[[0, 2]] == pytest.approx([g - p.crest_outside, g - p.cap])
    assert low[1] == pytest.approx(g - rounded.registration.lip_height_mm)
    assert compensated["front body"].mesh.bounds[1][1] == pytest.approx(-g)
    for nominal in finger_parts(rounded):
        name, part = nominal.name, compensated[nominal.name]
        # A face that recedes by g takes its area times g, to first order.
        corners = nominal.mesh.corners
        area = (
            np.linalg.norm(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
            ).sum()
            / 2
        )
        lost = nominal.volume - part.volume
        assert 0.5 * g * area < lost < 1.05 * g * area, name
        assert part.mesh.open_edges() == 0


def test_modules_lie_in_register_with_the_bonding_face_up(parts):
    laid = laid_meshes(list(parts.values()))
    for side in ("front", "back"):
        body, tubes = laid[f"{side} body"], laid[f"{side} tubes"]
        assert min(body.bounds[0][2], tubes.bounds[0][2]) == pytest.approx(0.0, abs=1e-9)
        assert body.volume == pytest.approx(parts[f"{side} body"].mesh.volume)
        # Both keep their distance: the tubes' axis lies in the bonding face of the body.
        face = 4.5 + (1.2 if side == "front" else 0.0)
        assert tubes.bounds[0][2] == pytest.approx(face - 1.7)
        flat = np.abs(body.points[:, 2] - face) < 1e-9
        assert flat.sum() > 20
    for name, mesh in laid.items():
        if not parts[name].module:
            assert mesh.bounds[0][2] == pytest.approx(0.0, abs=1e-9), name


def test_resin_area_is_that_of_the_faces_turned_to_the_other_module(reference, parts):
    facing = 0.0
    for name in ("back body", "back tubes"):
        corners, normals = parts[name].mesh.corners, parts[name].mesh.normals
        areas = (
            np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        )
        turned = (normals[:, 1] < -0.999) & (corners[:, :, 1].max(axis=1) < 1e-9)
        facing += areas[turned].sum()
    # The ends of the pins stand where the sockets of the pins are cut: both count once. The lip's top
    # stands for the face under it.
    assert facing == pytest.approx(bond_area(reference), rel=2e-3)


def test_bill_adds_up(reference, parts):
    bill = bill_of_materials(reference, list(parts.values()), laid_meshes(list(parts.values())))
    rows = {row["part"]: row for row in bill.rows}
    assert rows["front body"]["mass_g"] == pytest.approx(parts["front body"].volume * 1.145e-3)
    assert rows["base"]["mass_g"] == pytest.approx(parts["base"].volume * 1.18e-3)
    expected = sum(row["copies"] * row["mass_g"] for name, row in rows.items() if name != "gripper base")
    assert bill.totals["mass_g"] == pytest.approx(expected)
    bore = pi * 1.0**2 * 2 * (4.0 + 8.0) / 1000
    assert bill.totals["fluid_volume_in_tubes_per_chamber_ml"] == pytest.approx(bore)
    assert bill.totals["assembly_z_mm"] == pytest.approx(29.0 + 16.0)


def test_a_pin_that_the_compensation_eats_is_refused_by_name(reference):
    design = FingerDesign.model_validate({"registration": {"pin_diameter_mm": 0.2}})
    with pytest.raises(GeometryError, match=r"a feature is -0\.05 mm thin"):
        solids.module_body(design, "back", growth=0.15)


def test_a_plain_finger_without_pins_lip_and_seats_is_two_halves():
    design = FingerDesign.model_validate(
        {
            "bellows": {"units": 1, "fold_rise_mm": 0.0},
            "registration": {"pin_diameter_mm": 0.0, "lip_width_mm": 0.0},
            "marker_seats": {"units": []},
        }
    )
    made = {part.name: part for part in finger_parts(design)}
    assert "marker plate" not in made
    assert made["front body"].volume == pytest.approx(made["back body"].volume, rel=1e-12)
    assert len(cad.bodies(made["back tubes"].solid)) == 4
