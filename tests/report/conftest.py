"""Recorded runs and a surface, made once."""

from pathlib import Path

import pytest
from recorded_run import N_STATES, record_run


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Path:
    return record_run(tmp_path_factory.mktemp("runs") / "one")


@pytest.fixture(scope="session")
def reversed_run(tmp_path_factory) -> Path:
    return record_run(tmp_path_factory.mktemp("runs") / "reversed", sign=-1.0)


@pytest.fixture(scope="session")
def surface(recorded):
    from tubefoot.report.surface import read_surface

    return read_surface(recorded / f"fields/state_{N_STATES - 1:04d}.vtu")
