"""What the page needs to show fingers in space: three.js as one local module, our script, and the scene."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from tubefoot.vendored import vendored_text


@dataclass(frozen=True)
class Viewer:
    """Texts for the template: three.js in base64, our script, the scene as JSON without any `<`."""

    three: str
    script: str
    data: str

    @classmethod
    def of(cls, scene: Mapping[str, Any]) -> Viewer:
        """The viewer of a scene.

        scene : as `scene_of` makes it
        """
        return cls(
            b64encode(vendored_text("three/three.min.js").encode()).decode(),
            files("tubefoot.report").joinpath("viewer.js").read_text(encoding="utf-8"),
            json.dumps(scene, separators=(",", ":")).replace("<", "\\u003c"),
        )
