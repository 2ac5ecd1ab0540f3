"""Tables of other laboratories: declared units, odd separators, gaps, and errors that name the place."""

from __future__ import annotations

import numpy as np
import pytest
import tomli_w
from made_recordings import raw_series

from tubefoot.config import parse_settings
from tubefoot.errors import ConfigError
from tubefoot.units import DEG, KPA
from tubefoot.validation.column_map import ColumnMap, load_column_map
from tubefoot.validation.foreign_csv import read_foreign_csv
from tubefoot.validation.loading import load_recording, prepared
from tubefoot.validation.settled import settled_states

GERMAN = {
    "separator": ";",
    "decimal": ",",
    "skip_rows": 1,
    "header_rows": 2,
    "comment": "#",
    "encoding": "latin-1",
    "finger_units": 3,
    "columns": {
        "time": {"name": "Zeit", "unit": "ms"},
        "pressure_right": {"name": "P rechts", "unit": "mbar"},
        "pressure_left": {"name": "P links", "unit": "psi"},
        "angle": {"name": "Winkel", "unit": "mrad", "sign": -1},
        "drive": {"name": "Pumpe", "unit": "%"},
    },
}
MBAR, PSI = 0.1, 6.894757293168
"""In kPa."""


def german(rows):
    """Text of a table by the map above; None is a missing cell."""
    lines = ["Prüfstand 7", "Zeit;P rechts;P links;Winkel;Pumpe", "[ms];[mbar];[psi];[mrad];[%]", "# Beginn"]
    for row in rows:
        lines.append(";".join("--" if cell is None else f"{cell:.6f}".replace(".", ",") for cell in row))
    return "\n".join(lines) + "\n"


def written(tmp_path, rows, changed=None):
    path = tmp_path / "lab.csv"
    path.write_text(german(rows), encoding="latin-1")
    table = {**GERMAN, **(changed or {})}
    return path, parse_settings(table, ColumnMap)


def even_rows(count=40):
    return [[10.0 * i, 50.0 + i, 2.0 - 0.01 * i, -3.0 * i, 0.0] for i in range(count)]


def test_every_column_is_converted_by_its_unit(tmp_path):
    path, columns = written(tmp_path, even_rows())
    raw = read_foreign_csv(path, columns)
    assert raw.time[7] == pytest.approx(0.07)
    assert raw.pressures[7] / KPA == pytest.approx([57.0 * MBAR, (2.0 - 0.07) * PSI])
    assert raw.angle[7] == pytest.approx(0.021)
    assert raw.units == 3
    assert raw.provenance["unit_pressure_left"] == "psi"
    assert len(raw.provenance["sha256"]) == 64


def test_a_gap_leaves_out_only_what_is_missing(tmp_path):
    rows = even_rows()
    rows[5][3] = None
    rows[9][1] = None
    path, columns = written(tmp_path, rows)
    raw = read_foreign_csv(path, columns)
    # The drive of a row without a pressure is known: a pulse in it would be.
    assert len(raw.time) == 40
    assert np.flatnonzero(np.isnan(raw.pressures).any(axis=1)).tolist() == [9]
    assert len(raw.angle) == 39
    assert 0.05 not in raw.angle_time.round(6)


def test_a_foreign_table_gives_the_same_states_as_ours(tmp_path):
    """The same series, as another laboratory would write it; the drive is the only trace of the pulses."""
    raw = raw_series(cycles=1)
    angle = np.interp(raw.time, raw.angle_time, raw.angle)
    rows = np.column_stack(
        [
            1e3 * raw.time,
            raw.pressures[:, 0] / KPA / MBAR,
            raw.pressures[:, 1] / KPA / PSI,
            -1e3 * angle,
            100 * raw.drive,
        ]
    )
    path, columns = written(tmp_path, rows.tolist())
    foreign = settled_states(load_recording(path, columns))
    ours = settled_states(prepared(raw, "ours"))
    assert [s.branch for s in foreign] == [s.branch for s in ours]
    for one, other in zip(foreign, ours, strict=True):
        assert one.right == pytest.approx(other.right, abs=0.02 * KPA)
        assert one.left == pytest.approx(other.left, abs=0.02 * KPA)
        assert one.angle == pytest.approx(other.angle, abs=0.03 * DEG)


def test_a_drive_below_its_threshold_is_a_standing_pump(tmp_path):
    rows = even_rows()
    rows[10][4], rows[11][4] = 4.0, -60.0
    path, columns = written(tmp_path, rows, {"drive_threshold": 0.05})
    drive = read_foreign_csv(path, columns).drive
    assert (drive[10], drive[11]) == (0.0, pytest.approx(-0.6))


def test_angles_may_lie_in_a_file_of_their_own(tmp_path):
    table = {key: value for key, value in GERMAN.items() if key != "columns"}
    table["columns"] = {key: value for key, value in GERMAN["columns"].items() if key != "angle"}
    table |= {"header_rows": 1, "skip_rows": 0}
    table["angles"] = {
        "file": "{stem}-camera.csv",
        "time": {"name": "t", "unit": "s"},
        "angle": {"name": "a", "unit": "deg"},
    }
    path = tmp_path / "lab.csv"
    head = "Zeit;P rechts;P links;Pumpe\n"
    path.write_text(head + "".join(f"{10 * i};{i};{-i};0\n" for i in range(30)), encoding="latin-1")
    (tmp_path / "lab-camera.csv").write_text("t;a\n" + "".join(f"0,{i:02d};{i},5\n" for i in range(30)))
    raw = read_foreign_csv(path, parse_settings(table, ColumnMap))
    assert raw.angle_time[3] == pytest.approx(0.03)
    assert raw.angle[3] == pytest.approx(3.5 * DEG)


@pytest.mark.parametrize(
    ("key", "change", "message"),
    [
        ("pressure_right", {"unit": "kpaa"}, r"columns.pressure_right.unit.*`kpaa` is not a unit.*`kPa`"),
        ("time", {"unit": "kPa"}, r"columns.time.unit.*not a unit of time"),
        ("drive", {"unit": "V"}, r"columns.drive.unit.*not a unit of the pump's drive.*pwm255"),
        ("angle", {"units": "deg"}, r"unknown key `columns.angle.units`; did you mean `unit`"),
    ],
)
def test_an_unknown_unit_is_an_error_that_names_the_known_ones(tmp_path, key, change, message):
    table = {**GERMAN, "columns": {**GERMAN["columns"]}}
    table["columns"][key] = {**table["columns"][key], **change}
    path = tmp_path / "map.toml"
    path.write_text(tomli_w.dumps(table))
    with pytest.raises(ConfigError, match=message):
        load_column_map(path)


def test_a_column_without_a_unit_is_refused(tmp_path):
    table = {**GERMAN, "columns": {**GERMAN["columns"], "time": {"name": "Zeit"}}}
    with pytest.raises(ConfigError, match=r"missing key `columns.time.unit`"):
        parse_settings(table, ColumnMap)


def test_a_cell_that_is_no_number_is_named_by_line_and_column(tmp_path):
    path, columns = written(tmp_path, even_rows())
    lines = path.read_text(encoding="latin-1").splitlines()
    lines[10] = lines[10].replace(",", ".", 1)
    lines[10] = "6O,0" + lines[10][lines[10].index(";") :]
    path.write_text("\n".join(lines), encoding="latin-1")
    with pytest.raises(ConfigError, match=r"line 11, column `Zeit`: `6O,0` is not a number"):
        read_foreign_csv(path, columns)


def test_a_column_that_is_not_there_is_named_with_its_nearest(tmp_path):
    changed = {"columns": {**GERMAN["columns"], "time": {"name": "Zeitt", "unit": "ms"}}}
    path, columns = written(tmp_path, even_rows(), changed)
    with pytest.raises(ConfigError, match=r"no column `Zeitt` for time; did you mean `Zeit`"):
        read_foreign_csv(path, columns)


def test_time_that_runs_backwards_is_refused(tmp_path):
    rows = even_rows()
    rows[20][0] = 3.0
    path, columns = written(tmp_path, rows)
    with pytest.raises(ConfigError, match=r"time runs backwards from 0.19 to 0.003 s after 20 rows"):
        read_foreign_csv(path, columns)


def test_a_table_without_a_map_is_refused(tmp_path):
    path, _ = written(tmp_path, even_rows())
    with pytest.raises(ConfigError, match="needs a column map"):
        load_recording(path)
    with pytest.raises(ConfigError, match="no such recording"):
        load_recording(tmp_path / "nothing.csv")
