"""docs/rig.md says what the table of messages says."""

from __future__ import annotations

import tomllib
from xml.etree import ElementTree

from tubefoot.twin.firmware import FOLDER

DOCUMENT = (FOLDER.parent / "docs" / "rig.md").read_text()
with (FOLDER / "messages.toml").open("rb") as file:
    TABLE = tomllib.load(file)


def test_every_message_with_its_fields_and_ranges_is_described():
    for message in TABLE["message"]:
        [line] = [line for line in DOCUMENT.splitlines() if line.startswith(f"| 0x{message['id']:02x} |")]
        assert message["name"] in line
        assert message["doc"] in line
        for field in message["fields"]:
            assert f"{field['type']} {field['min']} to {field['max']}" in line


def test_every_fault_says_what_to_do():
    [faults] = [enum for enum in TABLE["enum"] if enum["name"] == "Fault"]
    for fault in faults["values"]:
        assert f"| {fault['value']} | `{fault['name']}` | {fault['doc']} | {fault['action']} |" in DOCUMENT


def test_the_wiring_names_every_pin_in_use():
    pins = (FOLDER / "finger_rig" / "pins.h").read_text()
    drawing = "".join(ElementTree.parse(FOLDER.parent / "docs" / "rig_wiring.svg").getroot().itertext())
    for name, pin in (("PIN_PUMP_ENABLE", "D9"), ("PIN_PUMP_FORWARD", "D7"), ("PIN_PUMP_REVERSE", "D8")):
        assert f"#define {name} {pin[1:]} " in pins
        assert pin in drawing
        assert f"| {pin} |" in DOCUMENT
