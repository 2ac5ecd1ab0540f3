import pytest

from tubefoot.reduced.files import reference_finger


@pytest.fixture(scope="session")
def reference():
    return reference_finger()
