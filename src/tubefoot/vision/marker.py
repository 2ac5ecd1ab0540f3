"""The marker's own picture: black and white cells of a dictionary code with its black border.

A marker picture has its x axis to the right and its z axis up, its centre at (0, 0).
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.errors import ConfigError

DICTIONARIES = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "4x4_100": cv2.aruco.DICT_4X4_100,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_16h5": cv2.aruco.DICT_APRILTAG_16h5,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36h11,
}
"""Marker dictionaries by the name used in layout files."""


def find_dictionary(name: str) -> cv2.aruco.Dictionary:
    """The OpenCV dictionary of a name.

    name : one of DICTIONARIES; anything else raises ConfigError
    """
    if name not in DICTIONARIES:
        raise ConfigError(f"unknown marker dictionary {name!r}; known: {', '.join(DICTIONARIES)}")
    return cv2.aruco.getPredefinedDictionary(DICTIONARIES[name])


@cache
def marker_cells(dictionary: str, marker_id: int) -> NDArray[np.float32]:
    """Cells (n, n) of a marker with its border, top row first: 1 is white, 0 is black.

    dictionary : name of the dictionary
    marker_id : which marker of it; one that it does not have raises ConfigError
    """
    codes = find_dictionary(dictionary)
    if not 0 <= marker_id < len(codes.bytesList):
        raise ConfigError(
            f"marker {marker_id} is not in dictionary {dictionary} (allowed: 0 to {len(codes.bytesList) - 1})"
        )
    count = codes.markerSize + 2
    picture = cv2.aruco.generateImageMarker(codes, marker_id, count * 8)
    cells = (picture[4::8, 4::8] > 127).astype(np.float32)
    cells.setflags(write=False)
    return cells


@cache
def all_codes(dictionary: str) -> NDArray[np.bool_]:
    """Inner cells (markers, 4, n, n) of every marker in all four quarter turns.

    dictionary : name of the dictionary
    """
    count = len(find_dictionary(dictionary).bytesList)
    codes = [marker_cells(dictionary, marker)[1:-1, 1:-1] > 0.5 for marker in range(count)]
    return np.array([[np.rot90(code, turn) for turn in range(4)] for code in codes])


def mirror_distance(dictionary: str, marker_id: int, others: tuple[int, ...]) -> int:
    """How many cells tell the mirror picture of a marker from the nearest of some markers.

    Zero means that a mirrored view (a reflection in the tank, a flipped camera) reads as a valid marker.

    dictionary : name of the dictionary
    marker_id : the marker that is mirrored
    others : the markers it could be taken for
    """
    mirrored = marker_cells(dictionary, marker_id)[1:-1, 1:-1][:, ::-1] > 0.5
    codes = all_codes(dictionary)[list(others)]
    return int(np.min(np.sum(codes != mirrored, axis=(2, 3))))
