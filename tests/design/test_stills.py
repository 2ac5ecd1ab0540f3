"""Pictures without a display, and what happens where they cannot be drawn."""

import numpy as np
import pytest
from PIL import Image

from tubefoot.design import stills
from tubefoot.design.stills import Item, Picture, draw
from tubefoot.design.surface import TriangleMesh

TETRAHEDRON = TriangleMesh(
    np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]),
    np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
)
PICTURE = Picture("red", [Item(TETRAHEDRON, (0.9, 0.1, 0.1))], view=(1.0, 1.0, 1.0))


@pytest.mark.slow
def test_a_red_part_is_red_and_fills_the_picture(tmp_path):
    path = draw([PICTURE], tmp_path)["red"]
    image = np.asarray(Image.open(path).convert("RGB")).astype(int)
    red = (image[..., 0] > 100) & (image[..., 1] < 90)
    assert red.mean() > 0.3
    assert (image[0] > 250).all()


def test_without_opengl_no_picture_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(stills.ctypes.util, "find_library", lambda name: None)
    assert draw([PICTURE], tmp_path) == {}


def test_a_renderer_that_dies_leaves_no_picture(tmp_path, monkeypatch):
    monkeypatch.setattr(stills, "can_draw", lambda: True)
    monkeypatch.setattr(stills.sys, "executable", "/bin/false")
    assert draw([PICTURE], tmp_path) == {}
