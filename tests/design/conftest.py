"""Designs and their solids, made once: the CAD kernel takes seconds to load."""

from pathlib import Path

import pytest

from tubefoot.design.finger import FingerDesign, load_design

EXAMPLES = Path(__file__).parents[2] / "examples" / "designs"


@pytest.fixture(scope="session")
def reference() -> FingerDesign:
    return load_design(EXAMPLES / "reference-3.toml")


@pytest.fixture(scope="session")
def rounded(reference) -> FingerDesign:
    """Two units with fillets on both sides."""
    return reference.with_bellows(units=2, fillet_outside_mm=0.4, fillet_chamber_mm=0.5)


@pytest.fixture(scope="session")
def parts(reference):
    from tubefoot.design.parts import finger_parts

    return {part.name: part for part in finger_parts(reference)}
