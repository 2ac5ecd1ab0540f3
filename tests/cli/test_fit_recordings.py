"""`tubefoot fit RECORDING...` as typed, on a table with foreign columns and units: files, sentences."""

import json
import tomllib

import numpy as np
import pytest
from tests.validation.lean_records import CONTENT, cyclic_pulses, known_values, made_record

from tubefoot.cli.main import app
from tubefoot.errors import ConfigError
from tubefoot.units import KPA

MAP = """
separator = ";"
finger_units = 3
[columns.time]
name = "t"
unit = "ms"
[columns.pressure_right]
name = "p1"
unit = "psi"
[columns.pressure_left]
name = "p2"
unit = "mbar"
[columns.drive]
name = "pump"
unit = "%"
[columns.angle]
name = "w"
unit = "mrad"
"""


def written(path, record):
    """The recording as a table of another laboratory: psi, mbar, milliseconds, milliradians, per cent."""
    drive = np.zeros(len(record.time))
    for pulse in record.pulses:
        running = (record.time >= pulse.start - 1e-9) & (record.time < pulse.end - 1e-9)
        drive[running] = pulse.direction * pulse.duty
    angle = np.interp(record.time, record.angle_time, record.angle)
    right, left = record.pressures.T
    rows = zip(1e3 * record.time, right / 6.894757e-3, left / 1e-4, 100 * drive, 1e3 * angle, strict=True)
    lines = ["t;p1;p2;pump;w", *(";".join(f"{value:.7g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


def test_a_foreign_table_is_fitted(tmp_path, capsys):
    values = known_values()
    written(tmp_path / "bench.csv", made_record(values, pulses=cyclic_pulses(count=6)))
    (tmp_path / "map.toml").write_text(MAP)
    out = tmp_path / "out"
    options = ["--columns", str(tmp_path / "map.toml"), "--sobol-samples", "0", "--out", str(out)]
    app(["fit", str(tmp_path / "bench.csv"), "--tilt-deg", "90", *options])
    said = capsys.readouterr().out
    assert "main cause: relaxation; seam as main cause: refuted" in said
    fitted = tomllib.loads((out / "fitted.toml").read_text())["shared"]
    assert fitted["scale"]["value"] == pytest.approx(values["scale"], rel=0.06)
    assert fitted["scale"]["low_95"] < fitted["scale"]["value"] < fitted["scale"]["high_95"]
    record = json.loads((out / "attribution.json").read_text())
    assert sum(record["shapley"]["bend_deg"].values()) == pytest.approx(
        record["offset"]["bend_deg"], abs=1e-6
    )
    # Lying in a level plane the ideal finger feels no weight; standing it would bend 0.6 % further.
    pressures = np.array([30.0, record["ideal"]["pressure_left_kpa"]]) * KPA
    level = CONTENT.to_finger().with_units(3).free_bending(pressures).bend
    assert record["ideal"]["bend_deg"] == pytest.approx(np.degrees(level), rel=1e-3)
    for name in ("fit.json", "windows.csv", "attribution.csv", "decisive.csv", "run.toml"):
        assert (out / name).exists(), name
    for name in ("fit", "learnt", "attribution"):
        assert (out / f"figures/{name}.png").stat().st_size > 10_000


def test_a_table_without_angles_is_fitted_to_its_pressures(tmp_path, capsys):
    values = known_values()
    written(tmp_path / "bench.csv", made_record(values, pulses=cyclic_pulses(count=6)))
    (tmp_path / "map.toml").write_text(MAP.partition("[columns.angle]")[0])
    options = ["--columns", str(tmp_path / "map.toml"), "--sobol-samples", "0", "--out", str(tmp_path)]
    app(["fit", str(tmp_path / "bench.csv"), *options])
    said = capsys.readouterr().out
    assert "figures: 3" in said
    assert "kPa RMS, no angles recorded" in said
    record = json.loads((tmp_path / "fit.json").read_text())
    assert record["rms_bend_deg"] is None
    assert record["rms_right_kpa"] < 0.1


def test_without_a_recording_it_says_what_to_do():
    with pytest.raises(ConfigError, match="no recording given"):
        app(["fit"])


def test_a_profile_of_nothing_is_refused_before_the_fit():
    with pytest.raises(ConfigError, match=r"`sem` is no unknown of the fit; did you mean `seam`\?"):
        app(["fit", "bench.mcap", "--profile", "sem"])
