"""An installed package has no checkout: it builds in the user's cache, from what it carries."""

import shutil

import pytest

from tubefoot.errors import ConfigError
from tubefoot.twin import firmware


@pytest.fixture
def carried(tmp_path, monkeypatch):
    """The firmware's sources and the board's program where a wheel puts them, without write permission."""
    folder = tmp_path / "package" / "firmware"
    shutil.copytree(firmware.CHECKOUT, folder, ignore=shutil.ignore_patterns("build", "second"))
    (folder / "build").mkdir()
    (folder / "build" / "board.hex").write_text(":00000001FF\n")
    monkeypatch.setattr(firmware, "FOLDER", folder)
    monkeypatch.setattr(firmware, "BUILD", folder / "build")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folder


def test_what_the_wheel_carries_is_taken_as_it_is(carried):
    assert firmware.built("board.hex") == carried / "build" / "board.hex"


def test_what_is_of_this_computer_is_built_once_in_the_cache(carried, tmp_path, monkeypatch):
    before = sorted(path for path in carried.rglob("*"))
    library = firmware.built("core.so")
    assert library.is_relative_to(tmp_path / "cache" / "tubefoot")
    assert library.read_bytes()[:4] == b"\x7fELF"
    assert sorted(path for path in carried.rglob("*")) == before
    monkeypatch.setattr(firmware.shutil, "which", lambda name: None)
    assert firmware.built("core.so") == library


def test_changed_sources_have_a_cache_of_their_own(carried, tmp_path):
    first = firmware._build_folder()
    with (carried / "native" / "core.cpp").open("a") as file:
        file.write("// changed\n")
    assert firmware._build_folder() != first


def test_a_missing_compiler_is_named(carried, monkeypatch):
    monkeypatch.setattr(firmware.shutil, "which", lambda name: "/usr/bin/make" if name == "make" else None)
    with pytest.raises(ConfigError, match=r"core\.so is not built, and make or g\+\+ is missing"):
        firmware.built("core.so")
    with pytest.raises(ConfigError, match=r"board_test\.elf is not built, and make or avr-gcc is missing"):
        firmware.built("board_test.elf")
