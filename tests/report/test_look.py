import numpy as np
import pytest
from PIL import Image

from tubefoot.report.curves import draw_curves
from tubefoot.report.look import End, _apart, line_of
from tubefoot.report.runs import load_runs
from tubefoot.report.scale import ColourScale, round_up, state_line


def end(x, y, name="a name"):
    return End(x, y, name, "black")


def test_names_that_would_overlap_are_moved_apart_about_their_middle():
    places = _apart([end(1.0, 0.0), end(1.0, 0.1), end(1.0, -0.1)], letter=0.01, line=1.0)
    assert np.diff(np.sort(places)) == pytest.approx([1.0, 1.0])
    assert np.mean(places) == pytest.approx(0.0)
    assert np.argsort(places).tolist() == [2, 0, 1]


def test_names_in_other_columns_stay():
    assert _apart([end(0.0, 0.0), end(1.0, 0.1)], letter=0.01, line=1.0) == [0.0, 0.1]


def test_the_name_of_a_line_that_runs_to_the_left_is_not_on_the_line():
    rising = End.of(np.array([0.0, -1.0]), np.array([0.0, -1.0]), "a", "black")
    falling = End.of(np.array([0.0, -1.0]), np.array([0.0, 1.0]), "a", "black")
    assert (rising.lean, falling.lean) == (-1, 1)


def test_the_first_runs_differ_in_colour_and_marker():
    looks = [line_of(number, 6) for number in range(6)]
    assert len({look["color"] for look in looks}) == len({look["marker"] for look in looks}) == 6


@pytest.mark.parametrize(("value", "rounded"), [(0.0, 1.0), (0.83, 1.0), (11.0, 15.0), (250.0, 300.0)])
def test_scales_end_at_round_numbers(value, rounded):
    assert round_up(value) == pytest.approx(rounded)


def test_a_signed_scale_is_symmetrical_and_covers_the_surface(surface):
    scale = ColourScale.of("s33_kpa", "S33 [kPa]", [surface], signed=True)
    # S33 = x, and the finger reaches to x = 11 mm.
    assert (scale.low, scale.high) == (-15.0, 15.0)
    assert ColourScale.of("von_mises_kpa", "", [surface], signed=False).low == 0.0


def test_a_minus_sign_does_not_change_a_name(reversed_run):
    (run,) = load_runs([reversed_run])
    assert state_line(run) == "one-unit\n−20.0 kPa, −4.0°"


def test_curves_name_runs_and_units_and_are_fit_for_print(recorded, reversed_run, tmp_path):
    pictures = draw_curves(load_runs([recorded, reversed_run]), tmp_path, say=lambda _: None)
    assert {picture.key for picture in pictures} == {
        "pressure-pressure",
        "pressure-angle",
        "pressure-volume",
        "volume-angle",
    }
    for picture in pictures:
        drawn = picture.svg.read_text()
        assert ">one<" in drawn
        assert ">reversed<" in drawn
        assert "[kPa]" in drawn or "[ml]" in drawn
        with Image.open(picture.png) as image:
            assert image.info["dpi"] == pytest.approx((200, 200), abs=0.1)
    assert (tmp_path / "curves.svg").exists()


def test_the_same_records_draw_the_same_file(recorded, tmp_path):
    runs = load_runs([recorded])
    first, second = (draw_curves(runs, tmp_path / str(k), lambda _: None)[0] for k in (1, 2))
    assert first.svg.read_bytes() == second.svg.read_bytes()
