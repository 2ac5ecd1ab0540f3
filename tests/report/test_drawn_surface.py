import numpy as np
import pytest

from tubefoot.design.finger import FingerDesign
from tubefoot.design.outline import chamber, silhouette
from tubefoot.errors import ConfigError
from tubefoot.report.surface import read_surface


def area(surface, positions):
    a, b, c = positions[surface.triangles].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def enclosed(surface, positions):
    a, b, c = positions[surface.triangles].transpose(1, 0, 2)
    return np.einsum("ti,ti->", a, np.cross(b, c)) / 6


def shoelace(points):
    x, z = points.T
    return abs(np.dot(x, np.roll(z, 1)) - np.dot(z, np.roll(x, 1))) / 2


def test_the_half_is_closed_and_the_whole_holds_twice_its_volume(surface):
    assert surface.is_half
    assert surface.whole().rest[:, 1].min() == pytest.approx(-4.5)
    half, whole = enclosed(surface, surface.rest), enclosed(surface.whole(), surface.whole().rest)
    assert half > 0
    assert whole == pytest.approx(2 * half, rel=1e-9)


def test_shear_across_the_mid_plane_changes_sign_in_the_mirror(surface):
    whole = surface.whole()
    np.testing.assert_allclose(whole.value("s13_kpa"), whole.rest[:, 1], atol=1e-9)
    np.testing.assert_allclose(whole.value("s23_kpa"), 2 * whole.rest[:, 1], atol=1e-9)
    np.testing.assert_allclose(whole.value("s33_kpa"), whole.rest[:, 0], atol=1e-9)


def test_the_cut_is_the_profile_less_its_chambers(surface):
    profile = FingerDesign().with_bellows(units=1).profile
    solid = shoelace(silhouette(profile).points()) - 2 * shoelace(chamber(profile).points())
    assert area(surface.cut(), surface.rest) == pytest.approx(solid, rel=1e-6)


def test_the_cut_has_an_outline_and_one_for_each_chamber(surface):
    loops = surface.cut().outlines()
    assert len(loops) == 3
    sides = sorted(np.sign(round(surface.rest[loop, 0].mean(), 6)) for loop in loops)
    assert sides == [-1, 0, 1]


def test_chamber_walls_are_not_seen_from_outside(surface):
    whole = surface.whole()
    outer = whole.outside()
    inner = whole.triangles.shape[0] - outer.triangles.shape[0]
    assert inner > 0
    assert enclosed(outer, whole.rest) > enclosed(whole, whole.rest) * 1.2


def test_the_deformed_shape_follows_the_displacement(surface):
    np.testing.assert_allclose(
        surface.deformed[:, 0] - surface.rest[:, 0], -0.01 * surface.rest[:, 2] ** 2, atol=1e-6
    )


def test_an_unknown_field_names_those_that_are_there(surface):
    with pytest.raises(ConfigError, match=r"holds no `s99_kpa`.*von_mises_kpa"):
        surface.value("s99_kpa")


def test_a_file_that_is_no_vtu_is_refused(tmp_path):
    import meshio

    path = tmp_path / "state_0001.vtu"
    meshio.Mesh(np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])]).write(path)
    with pytest.raises(ConfigError, match="no point data `displacement_mm`"):
        read_surface(path)
