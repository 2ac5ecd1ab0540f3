"""Fluid columns against drawn ones of known level."""

import numpy as np
import pytest

from tubefoot.errors import ConfigError
from tubefoot.vision.columns import column_level
from tubefoot.vision.compositor import Patch, Scene, render
from tubefoot.vision.exposure import Exposure, expose
from tubefoot.vision.layout import ColumnPlace
from tubefoot.vision.lens import Lens
from tubefoot.vision.plane import PlaneMap, PlanePose

LENS = Lens.centred(640, 480, 700.0, (-0.1, 0.03, 0.0, 0.0, 0.0))
PLANE = PlanePose.facing(220.0, 0.1, -0.15)
MAP = PlaneMap(LENS, PLANE)
RED, BLUE, GREY = (0.08, 0.08, 0.6), (0.6, 0.2, 0.08), (0.6, 0.6, 0.6)
COLUMN = ColumnPlace(name="right", start_mm=(-50, 20), end_mm=(40, 26), width_mm=2)


def column_frame(level, fluid=RED, seed=0):
    start, end = np.array(COLUMN.start_mm), np.array(COLUMN.end_mm)
    along = (end - start) / np.linalg.norm(end - start)
    across = 1.5 * np.array([-along[1], along[0]])
    tube = Patch(np.array([start - across, end - across, end + across, start + across]), GREY)
    things = [tube]
    if level > 0:
        top = start + level * along
        things.append(Patch(np.array([start - across, top - across, top + across, start + across]), fluid))
    light = render(Scene(LENS, PLANE, things, background=0.4, colour=True))
    return expose(light, Exposure(jpeg_quality=85, gradient=0.3), np.random.default_rng(seed))


@pytest.mark.parametrize("level", [6.0, 20.0, 43.3, 71.0, 85.0])
def test_level_is_found(level):
    found = column_level(column_frame(level), MAP, COLUMN)
    assert found.level == pytest.approx(level, abs=0.25)


def test_empty_and_full_columns():
    length = float(np.linalg.norm(np.subtract(COLUMN.end_mm, COLUMN.start_mm)))
    assert column_level(column_frame(0.0), MAP, COLUMN).level == 0.0
    assert column_level(column_frame(length), MAP, COLUMN).level == pytest.approx(length, abs=0.3)


def test_another_colour_is_not_the_fluid():
    assert column_level(column_frame(40.0, fluid=BLUE), MAP, COLUMN).level == 0.0
    blue = COLUMN.model_copy(update={"hue_deg": 225.0})
    assert column_level(column_frame(40.0, fluid=BLUE), MAP, blue).level == pytest.approx(40.0, abs=0.3)


def test_column_out_of_the_picture_is_unknown():
    away = COLUMN.model_copy(update={"end_mm": (400.0, 26.0)})
    assert np.isnan(column_level(column_frame(40.0), MAP, away).level)


def test_grey_frames_are_refused():
    with pytest.raises(ConfigError, match="colour frames"):
        column_level(np.zeros((480, 640), np.uint8), MAP, COLUMN)
