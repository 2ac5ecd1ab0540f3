"""The printed solid and the finite element mesh are one finger: volumes, cavities, walls."""

import numpy as np
import pytest

from tubefoot.design import cad, solids
from tubefoot.design.finger import FingerDesign
from tubefoot.design.measure import wall_thicknesses
from tubefoot.design.profile import chamber_rest_volume
from tubefoot.design.surface import TriangleMesh
from tubefoot.fea.finger_mesh import finger_mesh

SIZE_MM = 1.0
UNIONS = ("outside", "cavity_right", "cavity_left")
DESIGNS = {
    "mixed": {},
    "filleted": {"fillet_outside_mm": 0.3, "fillet_chamber_mm": 0.5},
    "uniform, steep": {"fold_wall_mm": 2.0, "partition_mm": 3.0, "crest_flat_mm": 5.5, "fold_run_mm": 4.0},
}


def facets_as_triangles(mesh, names) -> TriangleMesh:
    """Eight flat triangles for each nine-node facet, normals out of the solid."""
    nodes = np.vstack([mesh.facet_set(name).nodes for name in names])
    around = [0, 4, 1, 5, 2, 6, 3, 7]
    triangles = [nodes[:, [8, around[k], around[(k + 1) % 8]]] for k in range(8)]
    return TriangleMesh(mesh.points, np.vstack(triangles))


@pytest.fixture(scope="module", params=DESIGNS)
def pair(request):
    design = FingerDesign().with_bellows(units=2, **DESIGNS[request.param])
    return design, finger_mesh(design.profile, SIZE_MM)


def test_mesh_and_solid_have_one_volume(pair):
    design, mesh = pair
    skin = facets_as_triangles(mesh, [name for name in mesh.facets if name not in UNIONS])
    assert skin.open_edges() == 0
    body = cad.volume(solids.whole_body(design))
    # Flat triangles cut the fillets, by 5e-4 at this size; without fillets rounding is all that is left.
    tolerance = 6e-4 if design.bellows.fillet_outside_mm else 1e-9
    assert 2 * skin.volume == pytest.approx(body, rel=tolerance)


def test_what_the_triangles_cut_off_the_fillets_goes_with_the_square_of_their_size():
    design = FingerDesign().with_bellows(units=1, **DESIGNS["filleted"])
    fluid = cad.volume(solids.chamber_fluid(design))
    error = [
        -2 * facets_as_triangles(finger_mesh(design.profile, size), ["cavity_right"]).volume / fluid - 1
        for size in (1.0, 0.5)
    ]
    assert abs(error[1]) < 0.35 * abs(error[0])


@pytest.mark.parametrize("hand", ["right", "left"])
def test_cavity_and_fluid_have_one_volume(pair, hand):
    design, mesh = pair
    wall = facets_as_triangles(mesh, [f"cavity_{hand}"])
    # The wall's normals point into the fluid; the mid-plane closes it and adds nothing, since y = 0 there.
    fluid = -2 * wall.volume
    tolerance = 6e-4 if design.bellows.fillet_chamber_mm else 1e-9
    assert fluid == pytest.approx(cad.volume(solids.chamber_fluid(design)), rel=tolerance)
    assert cad.volume(solids.chamber_fluid(design)) == pytest.approx(
        chamber_rest_volume(design.profile), rel=1e-9
    )


def test_walls_measured_by_rays_agree(pair):
    design, mesh = pair
    skin = facets_as_triangles(mesh, [name for name in mesh.facets if name not in UNIONS])
    printed = cad.triangulated(solids.module_body(design, "back"))
    modelled = wall_thicknesses(skin, design.profile, y=1.7)
    exported = wall_thicknesses(printed, design.profile, y=1.7)
    assert [wall.name for wall in modelled] == [wall.name for wall in exported]
    for fe, cad_wall in zip(modelled, exported, strict=True):
        assert fe.least == pytest.approx(cad_wall.least, abs=0.03), fe.name
        assert fe.greatest == pytest.approx(cad_wall.greatest, abs=0.03), fe.name
        assert fe.places == cad_wall.places > 0


def test_a_thicker_wall_in_one_of_them_is_seen(pair):
    design, mesh = pair
    thicker = design.with_bellows(partition_mm=design.bellows.partition_mm + 0.1)
    skin = facets_as_triangles(mesh, [name for name in mesh.facets if name not in UNIONS])
    body = cad.volume(solids.whole_body(thicker))
    assert abs(2 * skin.volume - body) / body > 3e-3
