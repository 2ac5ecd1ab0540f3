import pytest
from recorded_run import record_run

from tubefoot.records import read_table, write_table
from tubefoot.report.differences import difference_lines, meeting_pressure, value_at
from tubefoot.report.runs import load_run


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run to 20 kPa, one whose angles are half as large again and that ends at 12 kPa, and one reversed."""
    root = tmp_path_factory.mktemp("differing")
    one, two, back = (record_run(root / name, name) for name in ("one", "two", "back"))
    rows = read_table(two / "curve.csv")[:4]
    write_table(two / "curve.csv", [{**row, "bend_deg": 1.5 * row["bend_deg"]} for row in rows])
    rows = read_table(back / "curve.csv")
    write_table(
        back / "curve.csv", [{**row, "pressure_right_kpa": -row["pressure_right_kpa"]} for row in rows]
    )
    return [load_run(path) for path in (one, two, back)]


def test_runs_meet_where_the_shortest_of_one_direction_ends(runs):
    assert meeting_pressure(runs) == pytest.approx(12.0)
    assert meeting_pressure(runs[::-1]) is None
    assert meeting_pressure([]) is None


def test_differences_are_read_at_one_pressure(runs):
    (bend,) = [line for line in difference_lines(runs) if line.name == "bend angle"]
    assert bend.values[:2] == pytest.approx([2.4, 3.6])
    assert bend.values[2] is None
    assert bend.shares[:2] == pytest.approx([0.0, 0.5])
    assert bend.shares[2] is None


def test_values_lie_on_straight_lines_between_states(runs):
    # 0.2 deg/kPa, states every 4 kPa.
    assert value_at(runs[0], "bend_deg", 6.0) == pytest.approx(1.2)
    assert value_at(runs[0], "bend_deg", 21.0) is None
    assert value_at(runs[0], "no_such_column", 6.0) is None
