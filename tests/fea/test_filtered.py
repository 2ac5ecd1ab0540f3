"""The paper's procedure: a grid of pressures, of which those states are kept that a pump could reach."""

import numpy as np
import pytest

from tubefoot.design.finger import Bellows, FingerDesign
from tubefoot.errors import ConfigError
from tubefoot.fea.finger_model import SolveSettings
from tubefoot.fea.solve import solve_design
from tubefoot.records import read_table

FINGER = FingerDesign(name="one", bellows=Bellows(units=1))
TABLE = {"element_size_mm": 4.0, "target": 10.0, "fields": "none"}
GRID = SolveSettings(**TABLE, states=2, cavities="filtered")


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    directory = tmp_path_factory.mktemp("filtered")
    return (
        solve_design(FINGER, directory / "grid", GRID),
        solve_design(FINGER, directory / "pumped", SolveSettings(**TABLE, states=4)),
    )


def test_accepted_states_have_opposite_volumes_within_three_percent(solved):
    grid, _ = solved
    right, left = (grid.column(f"volume_change_{hand}_ml")[1:] for hand in ("right", "left"))
    assert (right * left < 0).all()
    assert (np.abs(right + left) < 0.03 * np.maximum(np.abs(right), np.abs(left))).all()
    pressures = grid.column("pressure_right_kpa")[1:]
    assert set(np.round(pressures, 9)) == {5.0, 10.0}
    assert grid.summary["end_reason"].startswith(f"{len(right)} of ")


def test_the_grid_is_on_disk_with_every_state_and_surrounds_what_is_accepted(solved):
    grid, _ = solved
    rows = read_table(grid.directory / "grid.csv")
    accepted = [row for row in rows if float(row["accepted"])]
    assert len(accepted) == len(grid.curve) - 1
    mismatch = [float(row["mismatch_percent"]) for row in rows]
    assert min(mismatch) < -3 < 3 < max(mismatch)
    assert all(abs(float(row["mismatch_percent"])) < 3 for row in accepted)


def test_accepted_states_lie_near_the_coupled_path(solved):
    grid, pumped = solved
    at = grid.column("pressure_right_kpa")[1:]
    for name, near in (("bend_deg", 0.05), ("pressure_left_kpa", 0.06)):
        path = np.interp(at, pumped.column("pressure_right_kpa"), pumped.column(name))
        assert np.abs(grid.column(name)[1:] / path - 1).max() < near


def test_an_interrupted_grid_goes_on(solved, tmp_path, monkeypatch):
    from tubefoot.fea.filtered import PressureGrid

    whole, _ = solved
    follow = PressureGrid._follow
    solved_ratios = []

    def stopped(self, ratio):
        if len(solved_ratios) == 3:
            raise KeyboardInterrupt
        solved_ratios.append(ratio)
        return follow(self, ratio)

    monkeypatch.setattr(PressureGrid, "_follow", stopped)
    with pytest.raises(KeyboardInterrupt):
        solve_design(FINGER, tmp_path, GRID)
    repeated = []

    def counted(self, ratio):
        repeated.append(ratio)
        return follow(self, ratio)

    monkeypatch.setattr(PressureGrid, "_follow", counted)
    again = solve_design(FINGER, tmp_path, GRID)
    assert repeated
    assert not set(repeated) & set(solved_ratios)
    assert again.column("bend_deg") == pytest.approx(whole.column("bend_deg"), rel=1e-12)


@pytest.mark.parametrize(
    "other", [{"until": "bend_deg"}, {"air_left_ml": 1.0}, {"until": "pressure_left_kpa"}]
)
def test_a_grid_elsewhere_than_to_a_right_pressure_is_an_error(other):
    with pytest.raises((ConfigError, ValueError), match="filtered goes to a pressure_right_kpa"):
        SolveSettings(**TABLE, cavities="filtered", **other)
