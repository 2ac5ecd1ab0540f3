"""Reference finger profiles."""

from pathlib import Path

import pytest

from tubefoot.design.finger import FingerDesign, load_design

EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"


@pytest.fixture(scope="session")
def reference() -> FingerDesign:
    return load_design(EXAMPLES / "reference-3.toml")
