"""Settings files: TOML in, frozen records out, and errors that name the key, the value and its limit."""

from __future__ import annotations

import difflib
import tomllib
import typing
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from tubefoot.errors import ConfigError

SettingsType = TypeVar("SettingsType", bound="Settings")


class Settings(BaseModel):
    """A frozen table of settings; every key bears its unit, an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


def load_settings(path: Path | str, kind: type[SettingsType]) -> SettingsType:
    """The settings in a TOML file.

    path : the file to read
    kind : the settings class it must satisfy

    Raises ConfigError when the file is missing, is not TOML, or does not satisfy `kind`.
    """
    path = Path(path)
    return parse_settings(read_toml(path), kind, source=str(path))


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    path : the file to read

    Raises ConfigError when it is missing, unreadable or not TOML.
    """
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except IsADirectoryError:
        raise ConfigError(f"{path} is a directory; name a TOML file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read as text: {error}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error


def parse_settings(table: dict[str, Any], kind: type[SettingsType], source: str = "settings") -> SettingsType:
    """The settings in a table already read.

    table : nested keys and values
    kind : the settings class they must satisfy
    source : what to call the table in an error

    Raises ConfigError with one line for each fault.
    """
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        faults = [_describe(fault, kind) for fault in error.errors()]
        raise ConfigError(f"{source}: " + "\n".join(faults)) from None


def _describe(fault: Any, kind: type[BaseModel]) -> str:
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        known = _keys_beside(fault["loc"], kind)
        near = difflib.get_close_matches(str(fault["loc"][-1]), known, n=1, cutoff=0.4)
        hint = f"; did you mean `{near[0]}`?" if near else f"; known keys: {', '.join(sorted(known))}"
        return f"unknown key `{key}`{hint}"
    if fault["type"] == "missing":
        return f"missing key `{key}`"
    message = fault["msg"].removeprefix("Value error, ")
    if not key:
        return message
    message = message[0].lower() + message[1:]
    return f"`{key}` = {fault['input']!r}: {message}{_limits(fault['loc'], kind)}"


def _limits(loc: tuple[int | str, ...], kind: type[BaseModel]) -> str:
    """The allowed range of a numeric key, as text."""
    model = _model_at(loc[:-1], kind)
    field = model.model_fields.get(str(loc[-1])) if model else None
    bounds = {}
    for constraint in field.metadata if field else ():
        for name in ("ge", "gt", "le", "lt"):
            if (limit := getattr(constraint, name, None)) is not None:
                bounds[name[0]] = limit
    if {"g", "l"} <= bounds.keys():
        return f" (allowed: {bounds['g']:g} to {bounds['l']:g})"
    return ""


def _keys_beside(loc: tuple[int | str, ...], kind: type[BaseModel]) -> list[str]:
    model = _model_at(loc[:-1], kind)
    return list(model.model_fields) if model else []


def _model_at(loc: tuple[int | str, ...], kind: type[BaseModel]) -> type[BaseModel] | None:
    """The settings class that a path of keys leads to, None where it leads through something else."""
    model: type[BaseModel] | None = kind
    for part in loc:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part) if model else None
        model = _settings_class(field.annotation) if field else None
    return model


def _settings_class(annotation: Any) -> type[BaseModel] | None:
    """The settings class inside a (possibly optional, possibly container) annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in typing.get_args(annotation):
        if (found := _settings_class(inner)) is not None:
            return found
    return None
