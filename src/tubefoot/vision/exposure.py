"""Exposure: what optics, sensor and compression do to the light of a frame.

Order as in a camera: lighting and glare, blur of the lens, blur of motion, tone curve, photon and read noise,
eight bits, JPEG.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tubefoot.vision.compositor import Picture


@dataclass(frozen=True)
class Exposure:
    """One way of spoiling a frame.

    psf_px : standard deviation of the lens blur [px]
    read_noise : standard deviation of the dark noise [grey levels of 255]
    full_well : electrons at full white; sets the photon noise, 0 switches it off
    motion_px : length of a straight motion blur [px]
    motion_direction : its direction [rad]
    gradient : relative change of the light from the middle to an edge
    gradient_direction : its direction [rad]
    gamma : tone curve, output = input^(1/gamma)
    gain : factor on all light
    glare : brightness added by a round highlight, fraction of white
    glare_at : its place, fraction of width and height
    glare_px : its standard deviation [px]
    jpeg_quality : 1 to 100; 0 leaves the frame uncompressed
    """

    psf_px: float = 0.7
    read_noise: float = 2.0
    full_well: float = 2500.0
    motion_px: float = 0.0
    motion_direction: float = 0.0
    gradient: float = 0.0
    gradient_direction: float = 0.6
    gamma: float = 1.0
    gain: float = 1.0
    glare: float = 0.0
    glare_at: tuple[float, float] = (0.5, 0.5)
    glare_px: float = 30.0
    jpeg_quality: int = 0


def expose(light: Picture, exposure: Exposure, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The frame that a camera delivers, eight bits, same shape as the light.

    light : (height, width) or (height, width, 3) light, 1 is white
    exposure : what happens to it
    rng : source of the noise
    """
    picture = light * np.float32(exposure.gain)
    if exposure.gradient:
        picture = picture * _shaped(1 + exposure.gradient * _ramp(light, exposure.gradient_direction), light)
    if exposure.glare:
        picture = picture + _shaped(exposure.glare * _highlight(light, exposure), light)
    if exposure.psf_px > 0:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), exposure.psf_px), dtype=np.float32)
    if exposure.motion_px > 0:
        kernel = streak_kernel(exposure.motion_px, exposure.motion_direction)
        picture = np.asarray(cv2.filter2D(picture, -1, kernel), dtype=np.float32)
    if exposure.gamma != 1:
        picture = np.clip(picture, 0, 1) ** np.float32(1 / exposure.gamma)
    return _digitise(picture, exposure, rng)


def _digitise(picture: Picture, exposure: Exposure, rng: np.random.Generator) -> NDArray[np.uint8]:
    grey = picture * np.float32(255)
    if exposure.read_noise > 0 or exposure.full_well > 0:
        photon = np.clip(grey, 0, 255) * (255 / exposure.full_well if exposure.full_well > 0 else 0)
        deviation = np.sqrt(photon + exposure.read_noise**2, dtype=np.float32)
        grey = grey + deviation * rng.standard_normal(grey.shape, dtype=np.float32)
    frame = np.clip(grey + 0.5, 0, 255).astype(np.uint8)
    if exposure.jpeg_quality:
        _, packed = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, exposure.jpeg_quality])
        flag = cv2.IMREAD_COLOR if frame.ndim == 3 else cv2.IMREAD_GRAYSCALE
        frame = np.asarray(cv2.imdecode(packed, flag), dtype=np.uint8)
    return frame


def streak_kernel(length_px: float, direction: float) -> NDArray[np.float32]:
    """Kernel (n, n) of a straight, even motion during the exposure; it sums to one.

    length_px : how far the picture moves [px]
    direction : of the motion, from the picture's x axis towards its y axis [rad]
    """
    half = int(np.ceil(length_px / 2)) + 2
    along = (np.arange(400) + 0.5) / 400 - 0.5
    x = half + along * length_px * np.cos(direction)
    y = half + along * length_px * np.sin(direction)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    part_x, part_y = x - left, y - top
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for step_x, step_y, weight in (
        (0, 0, (1 - part_x) * (1 - part_y)),
        (1, 0, part_x * (1 - part_y)),
        (0, 1, (1 - part_x) * part_y),
        (1, 1, part_x * part_y),
    ):
        np.add.at(kernel, (top + step_y, left + step_x), weight)
    return kernel / kernel.sum()


def _ramp(light: Picture, direction: float) -> NDArray[np.float32]:
    height, width = light.shape[:2]
    across = np.linspace(-1, 1, width, dtype=np.float32)[None, :] * np.float32(np.cos(direction))
    down = np.linspace(-1, 1, height, dtype=np.float32)[:, None] * np.float32(np.sin(direction))
    return across + down


def _highlight(light: Picture, exposure: Exposure) -> NDArray[np.float32]:
    height, width = light.shape[:2]
    x = np.arange(width, dtype=np.float32)[None, :] - exposure.glare_at[0] * width
    y = np.arange(height, dtype=np.float32)[:, None] - exposure.glare_at[1] * height
    return np.exp(-(x**2 + y**2) / (2 * exposure.glare_px**2))


def _shaped(field: NDArray[np.float32], light: Picture) -> Picture:
    return field[..., None] if light.ndim == 3 else field
