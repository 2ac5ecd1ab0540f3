"""Layout files: the examples load; faults are told with value, limit and remedy."""

from pathlib import Path

import pytest

from tubefoot.config import load_settings, parse_settings
from tubefoot.errors import ConfigError
from tubefoot.vision.layout import MarkerLayout, reference_layout
from tubefoot.vision.marker import marker_cells, mirror_distance

GOOD = {"length_mm": 92, "markers": [{"id": 1, "z_mm": 14.5}, {"id": 2, "z_mm": 35.5}]}


@pytest.mark.parametrize(
    "path", sorted(Path("examples/vision").glob("finger-*.toml")), ids=lambda path: path.stem
)
def test_examples_load(path):
    layout = load_settings(path, MarkerLayout)
    assert layout.markers[-1].z_mm <= layout.length_mm


def changed(**change):
    return parse_settings({**GOOD, **change}, MarkerLayout)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"markers": [{"id": 1, "z_mm": 14.5}, {"id": 1, "z_mm": 35.5}]}, "repeat"),
        ({"markers": [{"id": 1, "z_mm": 14.5}, {"id": 2, "z_mm": 20}]}, r"5.5 mm apart .* at least 11.67 mm"),
        ({"markers": [{"id": 1, "z_mm": 40}, {"id": 2, "z_mm": 20}]}, "from the base to the tip"),
        ({"markers": [{"id": 8, "z_mm": 14.5}]}, r"marker 8 looks like .* in a mirror \(0 cells"),
        (
            {"markers": [{"id": 60, "z_mm": 14.5}]},
            r"marker 60 is not in dictionary 4x4_50 \(allowed: 0 to 49",
        ),
        ({"markers": [{"id": 1, "z_mm": 140}]}, "beyond the tip"),
        ({"quiet_zone_mm": 0.5}, r"too narrow .* 1.67 mm"),
        ({"rigid_base_mm": 60, "rigid_tip_mm": 40}, "leave nothing"),
        ({"dictionary": "4x4_51"}, "unknown marker dictionary"),
        ({"marker_size_mm": 10}, "did you mean `marker_side_mm`"),
        ({"columns": [{"name": "right", "start_mm": [1, 1], "end_mm": [1, 1]}]}, "same point"),
    ],
)
def test_faults_are_told(change, message):
    with pytest.raises(ConfigError, match=message):
        changed(**change)


def test_mirror_distance_of_a_symmetric_code_is_zero():
    assert mirror_distance("4x4_50", 8, (8,)) == 0
    assert mirror_distance("4x4_50", 4, (4,)) >= 2


def test_cells_have_a_black_border():
    cells = marker_cells("4x4_50", 4)
    assert cells.shape == (6, 6)
    assert cells[0].sum() == cells[-1].sum() == cells[:, 0].sum() == cells[:, -1].sum() == 0


def test_reference_layout_is_the_example():
    assert reference_layout() == load_settings("examples/vision/finger-12.toml", MarkerLayout)
