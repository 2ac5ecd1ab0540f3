import json
import zlib
from base64 import b64decode

import numpy as np
import pytest
from recorded_run import N_STATES, record_run

from tubefoot.errors import ConfigError
from tubefoot.report.runs import load_run
from tubefoot.report.scene import read_shape, scene_of
from tubefoot.report.viewer import Viewer


@pytest.fixture(scope="module")
def shape(recorded):
    return read_shape(load_run(recorded))


@pytest.fixture(scope="module")
def scene(recorded, shape):
    return scene_of([(load_run(recorded), shape)])


def unpacked(run, n_fields):
    """Triangles, and for each state positions [mm] and field bytes: what viewer.js reads, said once more."""
    raw = zlib.decompress(b64decode(run["data"]))
    triangles = np.frombuffer(raw, "<u4", 3 * run["triangles"]).reshape(-1, 3)
    at, n, states = triangles.nbytes, run["points"], []
    low, high = np.array(run["low"]), np.array(run["high"])
    for _ in run["states"]:
        points = np.frombuffer(raw, "<u2", 3 * n, at).reshape(3, n).T / 65535 * (high - low) + low
        fields = np.frombuffer(raw, "u1", n_fields * n, at + 6 * n).reshape(n_fields, n)
        states.append((points, fields))
        at += (6 + n_fields) * n
    assert at == len(raw)
    return triangles, states


def test_the_state_at_rest_comes_first_without_stress(shape):
    assert shape.steps == [0, N_STATES - 1]
    assert np.abs(shape.values["von_mises_kpa"][0]).max() == 0.0
    x, _, z = shape.positions[1].T
    # The recorded run is bent by x -> x - 0.01 z^2.
    assert x == pytest.approx(shape.positions[0, :, 0] - 0.01 * z**2)


def test_packing_keeps_positions_and_stress_within_half_a_step(scene, shape):
    (run,) = scene["runs"]
    triangles, states = unpacked(run, len(scene["fields"]))
    assert (triangles == shape.triangles).all()
    span = np.ptp(shape.positions, axis=(0, 1)).max()
    for (points, fields), exact, number in zip(states, shape.positions, range(2), strict=True):
        assert np.abs(points - exact).max() <= 0.51 * span / 65535
        for values, field in zip(fields, scene["fields"], strict=True):
            low, high = field["low"], field["high"]
            clipped = np.clip(shape.values[field["key"]][number], low, high)
            assert np.abs(values / 255 * (high - low) + low - clipped).max() <= 0.51 * (high - low) / 255


def test_triangles_are_sorted_into_outside_chambers_and_cut(shape):
    rest = shape.positions[0]
    ends = np.cumsum([shape.outside, shape.walls])
    outside, walls, cut = np.split(rest[shape.triangles], ends)
    assert (np.abs(cut[..., 1]) < 1e-9).all()
    assert len(cut) > 0
    # The chambers of the finger lie within its outside.
    for axis in (0, 2):
        assert walls[..., axis].min() > outside[..., axis].min() + 0.5
        assert walls[..., axis].max() < outside[..., axis].max() - 0.5
    assert walls[..., 1].max() < outside[..., 1].max() - 0.5


def test_light_does_not_bleed_over_sharp_edges(shape):
    a, b, c = shape.positions[0][shape.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first = {}
    for triangle, normal in zip(shape.triangles, normals, strict=True):
        for point in triangle:
            assert first.setdefault(int(point), normal) @ normal > np.cos(np.radians(33.0))


def test_shear_across_the_mirror_plane_is_marked_to_change_its_sign(scene):
    odd = {field["key"]: field["odd"] for field in scene["fields"]}
    assert odd == {"von_mises_kpa": False, "s33_kpa": False, "s13_kpa": True, "s23_kpa": True}


def test_states_are_described_by_the_curve(scene):
    (run,) = scene["runs"]
    assert [state["bend_deg"] for state in run["states"]] == pytest.approx([0.0, 4.0])


def test_a_run_without_fields_has_no_shape(tmp_path):
    run = record_run(tmp_path / "bare")
    for path in (run / "fields").iterdir():
        path.unlink()
    assert read_shape(load_run(run)) is None


def test_field_files_of_different_meshes_are_refused(tmp_path, recorded):
    run = record_run(tmp_path / "mixed")
    import pyvista

    grid = pyvista.read(recorded / f"fields/state_{N_STATES - 1:04d}.vtu")
    grid.extract_cells(range(grid.n_cells // 2)).save(run / "fields/state_0002.vtu")
    with pytest.raises(ConfigError, match="different meshes"):
        read_shape(load_run(run))


def test_names_cannot_end_the_element_that_holds_them(scene):
    named = {**scene, "runs": [{**scene["runs"][0], "name": "</script><b>"}]}
    text = Viewer.of(named).data
    assert "<" not in text
    assert json.loads(text)["runs"][0]["name"] == "</script><b>"
