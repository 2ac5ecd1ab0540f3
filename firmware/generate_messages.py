"""Write the C header and the Python module of the messages from `messages.toml`.

Run it plainly to write both, with `--check` to exit 1 when either is out of date.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from textwrap import fill, indent

HERE = Path(__file__).resolve().parent
HEADER = HERE / "finger_rig" / "messages.h"
MODULE = HERE.parent / "src" / "tubefoot" / "lab" / "messages.py"

C_TYPES = {"u8": "uint8_t", "u16": "uint16_t", "u32": "uint32_t", "i8": "int8_t", "i32": "int32_t"}
STRUCT_CODES = {"u8": "B", "u16": "H", "u32": "I", "i8": "b", "i32": "i"}
TYPE_RANGES = {"u8": (0, 255), "u16": (0, 65535), "u32": (0, 2**32 - 1), "i8": (-128, 127)}
NOTICE = "Generated from firmware/messages.toml by firmware/generate_messages.py: edit the table, not this."


def main(arguments: list[str]) -> int:
    """The exit code, after writing (or, with `--check` among `arguments`, comparing) both files."""
    with (HERE / "messages.toml").open("rb") as file:
        table = tomllib.load(file)
    stale = []
    for path, text in ((HEADER, c_header(table)), (MODULE, python_module(table))):
        if path.exists() and path.read_text() == text:
            continue
        stale.append(path.name)
        if "--check" not in arguments:
            path.write_text(text)
            print(f"written: {path.relative_to(HERE.parent)}")
    if stale and "--check" in arguments:
        print(f"out of date: {', '.join(stale)}; run `make -C firmware messages`", file=sys.stderr)
        return 1
    return 0


def c_header(table: dict) -> str:
    """The header for the board, from the parsed `table`."""
    lines = [f"// {NOTICE}", "#pragma once", "#include <stdint.h>", ""]
    lines.append(f"#define PROTOCOL_VERSION {table['protocol_version']}")
    lines += [f"#define {name.upper()} {_c_number(value)}" for name, value in table["constants"].items()]
    for enum in table["enum"]:
        lines += ["", f"// {enum['doc']}", f"enum {enum['name']} : {C_TYPES[enum.get('type', 'u8')]} {{"]
        prefix = _snake(enum["name"]).upper()
        for entry in enum["values"]:
            lines.append(f"  {prefix}_{entry['name'].upper()} = {entry['value']},  // {entry['doc']}")
        lines.append("};")
    for message in table["message"]:
        name = message["name"]
        lines += ["", f"// {message['doc']}", f"#define MSG_{_snake(name).upper()} 0x{message['id']:02x}"]
        if message["fields"]:
            lines.append(f"struct __attribute__((packed)) {name}Message {{")
            for field in message["fields"]:
                size = f"[{field['count']}]" if "count" in field else ""
                lines.append(f"  {C_TYPES[field['type']]} {field['name']}{size};  // {field['doc']}")
            lines.append("};")
    lines += ["", *_c_range_check(table), ""]
    return "\n".join(lines)


def _c_range_check(table: dict) -> list[str]:
    """Three-way check of a command's payload: known, of the right length, every field in its range."""
    lines = [
        "enum PayloadVerdict : uint8_t {",
        "  PAYLOAD_OK,",
        "  PAYLOAD_OUT_OF_RANGE,",
        "  PAYLOAD_WRONG_LENGTH,",
        "  PAYLOAD_UNKNOWN,",
        "};",
        "",
        "// Judges the payload of a command to the board by the table.",
        "static inline PayloadVerdict judge_payload(uint8_t id, const uint8_t *payload, uint8_t length) {",
        "  (void)payload;",
        "  switch (id) {",
    ]
    for message in table["message"]:
        if message["to"] != "board":
            continue
        guard = message.get("test_only", False)
        name = message["name"]
        lines += ["#ifdef TEST_HOOKS"] if guard else []
        lines.append(f"    case MSG_{_snake(name).upper()}: {{")
        if not message["fields"]:
            lines.append("      return length == 0 ? PAYLOAD_OK : PAYLOAD_WRONG_LENGTH;")
        else:
            lines += [
                f"      if (length != sizeof({name}Message)) return PAYLOAD_WRONG_LENGTH;",
                f"      const {name}Message *m = (const {name}Message *)payload;",
            ]
            faults = [condition for field in message["fields"] for condition in _c_faults(field)]
            lines.append(f"      bool out = {' || '.join(faults) or 'false'};")
            lines.append("      return out ? PAYLOAD_OUT_OF_RANGE : PAYLOAD_OK;")
        lines.append("    }")
        lines += ["#endif"] if guard else []
    return [*lines, "    default: return PAYLOAD_UNKNOWN;", "  }", "}"]


def _c_faults(field: dict) -> list[str]:
    """C conditions under which a field is out of range; those the type excludes are left out."""
    low, high = TYPE_RANGES[field["type"]]
    name = f"m->{field['name']}"
    faults = [f"{name} < {_c_number(field['min'])}"] if field["min"] > low else []
    faults += [f"{name} > {_c_number(field['max'])}"] if field["max"] < high else []
    return faults + ([f"{name} == 0"] if field.get("not_zero") else [])


def python_module(table: dict) -> str:
    """The module for the host, from the parsed `table`."""
    lines = [
        f'"""The messages between host and board, as frozen records.\n\n{NOTICE}\n"""',
        "",
        "# fmt: off",
        "from __future__ import annotations",
        "",
        "import struct",
        "from dataclasses import dataclass",
        "from enum import IntEnum, IntFlag",
        "from typing import ClassVar",
        "",
        f"PROTOCOL_VERSION = {table['protocol_version']}",
        *[f"{name.upper()} = {value}" for name, value in table["constants"].items()],
    ]
    for enum in table["enum"]:
        kind = "IntFlag" if enum.get("flags") else "IntEnum"
        lines += ["", "", f"class {enum['name']}({kind}):", f'    """{enum["doc"]}."""', ""]
        for entry in enum["values"]:
            lines += [f"    {entry['name'].upper()} = {entry['value']}", f'    """{entry["doc"]}"""']
    actions = {
        entry["name"].upper(): entry["action"]
        for enum in table["enum"]
        for entry in enum["values"]
        if "action" in entry
    }
    lines += ["", "", "FAULT_ACTIONS: dict[Fault, str] = {"]
    for name, action in actions.items():
        lines += [f"    Fault.{name}: (", *_string_lines(action, 8), "    ),"]
    lines += ["}", '"""What to do about each fault."""', "", "", *_BASE_CLASS.splitlines()]
    for message in table["message"]:
        lines += ["", "", *_python_message(message)]
    lines += ["", "", "MESSAGES: dict[int, type[Message]] = {"]
    lines += [f"    {message['name']}.ID: {message['name']}," for message in table["message"]]
    lines += ["}", '"""Every message by its id."""', ""]
    return "\n".join(lines)


_BASE_CLASS = '''class Message:
    """A message; its fields are the numbers on the wire."""

    ID: ClassVar[int]
    LAYOUT: ClassVar[struct.Struct]
    RANGES: ClassVar[dict[str, tuple[int, int]]]
    ARRAYS: ClassVar[dict[str, int]]
    """Fields that hold several numbers, and how many."""'''


def _python_message(message: dict) -> list[str]:
    fields = message["fields"]
    doc = fill(f"{message['doc']}.", 100)
    docs = [fill(f"{field['name']} : {field['doc']}", 100, subsequent_indent="    ") for field in fields]
    text = "\n\n".join([doc, "\n".join(docs)]) if docs else doc
    lines = ["@dataclass(frozen=True, slots=True)", f"class {message['name']}(Message):"]
    lines += indent(f'"""{text}' + ("\n" if docs else "") + '"""', "    ").splitlines()
    codes = "".join(STRUCT_CODES[field["type"]] * field.get("count", 1) for field in fields)
    lines += ["", f"    ID: ClassVar[int] = 0x{message['id']:02X}"]
    lines.append(f'    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<{codes}")')
    lines.append("    RANGES: ClassVar[dict[str, tuple[int, int]]] = {" + ("}" if not fields else ""))
    if fields:
        lines += [f'        "{field["name"]}": ({field["min"]}, {field["max"]}),' for field in fields]
        lines += ["    }"]
    arrays = {field["name"]: field["count"] for field in fields if "count" in field}
    items = ", ".join(f'"{name}": {count}' for name, count in arrays.items())
    lines.append(f"    ARRAYS: ClassVar[dict[str, int]] = {{{items}}}")
    if fields:
        lines.append("")
    for field in fields:
        kind = "tuple[int, ...]" if "count" in field else "int"
        lines.append(f"    {field['name']}: {kind}")
    return lines


def _string_lines(text: str, depth: int) -> list[str]:
    parts = fill(text, 80).splitlines()
    return [
        " " * depth + '"' + part + (" " if number < len(parts) - 1 else "") + '"'
        for number, part in enumerate(parts)
    ]


def _snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def _c_number(value: int) -> str:
    return f"{value}u" if value > 32767 else str(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
