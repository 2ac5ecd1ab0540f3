"""The finger for the page's 3D view: its outline along the length, from the design."""

from __future__ import annotations

from typing import Any

import numpy as np

from tubefoot.design.finger import FingerDesign
from tubefoot.design.outline import silhouette


def finger_model(design: FingerDesign) -> dict[str, Any]:
    """What the page draws along the measured middle line; lengths in mm.

    design : of the finger

    `outline` is the right side from base to tip as [height, half width], `depth_mm` its size across the
    bending plane, `length_mm` from base to tip.
    """
    profile = design.profile
    points = silhouette(profile).points()
    right = points[points[:, 0] > 0]
    right = right[np.argsort(right[:, 1], kind="stable")]
    right = np.add(right, (0.0, profile.cap))
    return {
        "outline": np.round(right[:, ::-1], 3).tolist(),
        "depth_mm": profile.height,
        "length_mm": round(profile.envelope[2], 3),
        "units": profile.units,
        "partition_mm": profile.partition,
    }
