"""The course in time is drawn for solves in time only, from the recorded columns."""

import csv

import numpy as np
from matplotlib.axes import Axes
from recorded_run import record_run

from tubefoot.records import write_table
from tubefoot.report.runs import load_run
from tubefoot.report.time_course import draw_time_courses


def in_time(directory, times):
    record_run(directory)
    path = directory / "curve.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    write_table(path, [{**row, "time_s": at} for row, at in zip(rows, times, strict=True)])
    return load_run(directory)


def test_both_pressures_and_the_angle_are_drawn_over_time(tmp_path, monkeypatch):
    times = [0.0, 0.5, 1.0, 10.0, 100.0, 1000.0]
    run = in_time(tmp_path / "run", times)
    drawn = []
    original = Axes.plot
    monkeypatch.setattr(
        Axes, "plot", lambda axes, x, y, **look: drawn.append((x, y)) or original(axes, x, y, **look)
    )
    picture = draw_time_courses([run], tmp_path)
    assert picture.svg.exists()
    for name in ("pressure_right_kpa", "pressure_left_kpa", "bend_deg"):
        assert any(np.array_equal(x, times) and np.array_equal(y, run.curve[name]) for x, y in drawn), name


def test_solves_without_time_are_left_out(tmp_path):
    record_run(tmp_path / "run")
    assert draw_time_courses([load_run(tmp_path / "run")], tmp_path) is None
    empty = in_time(tmp_path / "elastic", [""] * 6)
    assert draw_time_courses([empty], tmp_path) is None
