"""Settings files: what is wrong is named, with the key, the value, its limit and the nearest known key."""

from typing import Annotated

import pytest
from pydantic import Field

from tubefoot.config import Settings, load_settings, parse_settings
from tubefoot.errors import ConfigError


class Inner(Settings):
    wall_mm: Annotated[float, Field(ge=0.4, le=10.0)] = 1.5


class Outer(Settings):
    name: str
    inner: Inner = Inner()


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"name": "a", "inner": {"wall": 1.0}}, ["`inner.wall`", "`wall_mm`"]),
        ({"name": "a", "iner": {}}, ["`iner`", "`inner`"]),
        ({"name": "a", "inner": {"wall_mm": 11.0}}, ["`inner.wall_mm` = 11.0", "0.4 to 10"]),
        ({"name": "a", "inner": {"wall_mm": "thick"}}, ["`inner.wall_mm` = 'thick'", "number"]),
        ({}, ["missing key `name`"]),
        ({"name": "a", "zzz": 1}, ["known keys: inner, name"]),
    ],
)
def test_faults_are_named(table, words):
    with pytest.raises(ConfigError) as caught:
        parse_settings(table, Outer)
    for word in words:
        assert word in str(caught.value)


def test_every_fault_is_told_at_once():
    with pytest.raises(ConfigError) as caught:
        parse_settings({"inner": {"wall_mm": -1}}, Outer)
    assert "missing key `name`" in str(caught.value)
    assert "`inner.wall_mm` = -1" in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"name = ", "not valid TOML"), (b"\xff\xfe\x00", "cannot be read as text")],
)
def test_unreadable_files(tmp_path, content, words):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=words):
        load_settings(path, Outer)


def test_missing_file_and_directory(tmp_path):
    with pytest.raises(ConfigError, match="no such file"):
        load_settings(tmp_path / "none.toml", Outer)
    with pytest.raises(ConfigError, match="is a directory"):
        load_settings(tmp_path, Outer)
