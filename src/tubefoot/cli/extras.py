"""Which extras a verb needs, for the message when a package of theirs is not installed."""

from __future__ import annotations

from collections.abc import Sequence

EXTRAS = {
    "new": "",
    "check": "cad",
    "export": "cad",
    "solve": "fea",
    "reduce": "fea",
    "report": "fea",
    "screen": "study",
    "optimise": "study",
    "rig": "lab,twin",
    "calibrate-camera": "vision",
    "track": "vision",
    "bend": "lab,vision,twin",
    "grasp": "lab,vision,twin",
    "fit": "fea,lab,vision,twin",
    "validate": "fea,lab,vision,twin",
    "dashboard": "dashboard,twin",
    "demo": "all",
}
"""Verb to extras; `--sim` wants `twin`, a real bench does without it."""


def missing_package(package: str, words: Sequence[str]) -> str:
    """What to tell about a package that is not installed.

    package : module that could not be imported; words : of the command line, without the program
    """
    verb = next((word for word in words if word in EXTRAS), "")
    extras = EXTRAS.get(verb) or "all"
    named = f"`tubefoot {verb}`" if verb else "this"
    return (
        f"{named} needs the package of `{package}`, which is not installed here; install its extras: "
        f"pip install 'tubefoot[{extras}]' (docs/how_to/install.md tells what each holds)"
    )
