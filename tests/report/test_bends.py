import pytest

from tubefoot.records import Run, write_table
from tubefoot.report.bends import draw_bends
from tubefoot.report.runs import load_run


def bend(directory, angles):
    """A recorded run of two motions, a frame a second."""
    run = Run(directory, "bend", {})
    rows = [
        {
            "part": part,
            "time_s": float(number),
            "bend_deg": angle,
            "target_deg": 30.0,
            "direction": 1,
            "duty": 0.5,
        }
        for part in ("out", "back")
        for number, angle in enumerate(angles)
    ]
    write_table(run.path("bend.csv"), rows)
    run.finish()
    return load_run(directory)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    root = tmp_path_factory.mktemp("bends")
    runs = [bend(root / "one", [0.0, 15.0, 30.0]), bend(root / "two", [0.0, "", 31.0])]
    return draw_bends([*runs, bend(root / "blind", ["", "", ""])], root)


def test_runs_share_a_figure_and_are_named_in_it(drawn):
    text = drawn.svg.read_text()
    assert ">one<" in text
    assert ">two<" in text
    assert ">blind<" not in text
    assert "bench time [s]" in text


def test_one_run_alone_is_no_comparison(tmp_path):
    assert draw_bends([bend(tmp_path / "one", [0.0, 1.0])], tmp_path) is None
