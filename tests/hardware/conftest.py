"""Options of the tests that need a bench."""


def pytest_addoption(parser):
    parser.addoption("--port", default=None, help="serial port of a real bench")
