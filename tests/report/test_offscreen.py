import sys

import numpy as np
import pytest
from PIL import Image

from tubefoot.report.offscreen import NoPicture, Shot, View, draw_solids
from tubefoot.report.pictures import draw_solve_pictures
from tubefoot.report.scale import ColourScale
from tubefoot.report.surface import Surface

FRONT = View((0.0, -1.0, 0.0))


def box(width, depth, height, value):
    """A closed box with one corner at the origin."""
    import pyvista

    shape = pyvista.Box((0, width, 0, depth, 0, height)).triangulate().clean()
    points = np.asarray(shape.points, dtype=float)
    triangles = shape.faces.reshape(-1, 4)[:, 1:]
    return Surface(points, points, triangles, {"von_mises_kpa": np.full(len(points), value)})


def test_a_view_measures_right_and_up():
    flat = FRONT.project(np.array([[3.0, 7.0, 2.0]]))
    np.testing.assert_allclose(flat, [[3.0, 2.0]])


def test_a_renderer_that_dies_is_told_with_the_remedy(monkeypatch, tmp_path):
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho 'bad display' >&2\nkill -SEGV $$\n")
    broken.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(broken))
    scale = ColourScale("von_mises_kpa", "", 0.0, 1.0)
    with pytest.raises(NoPicture, match=r"apt-get install .*libosmesa6.*VTK said: bad display"):
        draw_solids([Shot(box(1, 1, 1, 0.5), scale, FRONT)])


@pytest.mark.slow
def test_a_face_towards_the_camera_has_its_size_and_the_colour_of_the_scale():
    from matplotlib import colormaps

    scale = ColourScale("von_mises_kpa", "", 0.0, 10.0)
    tall, flat = draw_solids([Shot(box(5, 3, 20, 4.0), scale, FRONT), Shot(box(12, 3, 4, 8.0), scale, FRONT)])
    for image, size, value in ((tall, (5, 20), 4.0), (flat, (12, 4), 8.0)):
        inked = image.pixels.min(axis=2) < 240
        rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
        density = image.pixels.shape[0] / (image.extent[3] - image.extent[2])
        # Edges are drawn with a width of some pixels.
        assert np.ptp(columns) / density == pytest.approx(size[0], abs=0.2)
        assert np.ptp(rows) / density == pytest.approx(size[1], abs=0.2)
        middle = image.pixels[image.pixels.shape[0] // 2, image.pixels.shape[1] // 2]
        wanted = np.array(colormaps[scale.map_name](value / 10.0)[:3]) * 255
        np.testing.assert_allclose(middle, wanted, atol=6)


@pytest.mark.slow
def test_the_pictures_of_a_solve_lie_in_its_directory(recorded):
    said = []
    drawn = draw_solve_pictures(recorded, say=said.append)
    assert said == []
    assert {path.stem for path in drawn} >= {"shape", "section", "stress-s13", "stress-s23", "stress-s33"}
    with Image.open(recorded / "pictures" / "shape.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    # Warm colours of the stress scale cover a good part of the picture.
    assert (pixels[..., 0] - pixels[..., 2] > 40).mean() > 0.1
