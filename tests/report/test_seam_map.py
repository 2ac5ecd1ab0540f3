"""The map of the bond plane: pulled parts red, pressed ones blue, forces from the table, none without it."""

import numpy as np
from matplotlib import image
from matplotlib.axes import Axes
from recorded_run import N_STATES, record_run

from tubefoot.records import write_table
from tubefoot.report.runs import load_run
from tubefoot.report.seam import draw_seam
from tubefoot.report.surface import read_surface


def with_seam(directory, **forces):
    record_run(directory)
    rows = [
        {"step": step, "place": place, "opening_force_n": step * force, "peeling_moment_n_mm": 10.0 * force}
        for step in range(N_STATES)
        for place, force in {"all": 0.0, "right": 1.5, "left": -0.75, **forces}.items()
    ]
    write_table(directory / "seam.csv", rows)
    return load_run(directory)


def drawn(run, directory):
    return draw_seam([(run, read_surface(run.last_fields))], directory)


def test_the_pulled_side_is_red_and_the_pressed_one_blue(tmp_path):
    """S33 = x in the recorded run: positive on the right."""
    picture = drawn(with_seam(tmp_path / "run"), tmp_path)
    pixels = image.imread(picture.png)[..., :3]
    ruddy = pixels[..., 0] - pixels[..., 2]
    columns = np.flatnonzero((np.abs(ruddy) > 0.1).any(axis=0))
    finger = ruddy[:, columns[0] : columns[-1]]
    finger = finger[:, : int(0.75 * finger.shape[1])]  # the colour bar is on the right
    reds, blues = ((sign * finger > 0.1).sum(axis=0) for sign in (1, -1))
    middle = [np.average(np.arange(len(amount)), weights=amount) for amount in (blues, reds)]
    assert middle[0] < middle[1]


def test_the_forces_of_the_last_state_stand_below_their_sides(tmp_path, monkeypatch):
    written = {}

    def note(axes, x, y, text, **look):
        written[text.split("\n")[0]] = (x, text)

    run = with_seam(tmp_path / "run")
    monkeypatch.setattr(Axes, "text", note)
    drawn(run, tmp_path)
    right, left = written["right"], written["left"]
    assert right[0] > 0 > left[0]
    assert "+7.50 N\n+15.0 N mm" in right[1]
    assert "−3.75 N\n−7.5 N mm" in left[1]


def test_without_a_table_there_is_no_map(tmp_path):
    record_run(tmp_path / "run")
    assert drawn(load_run(tmp_path / "run"), tmp_path) is None
