"""A clamped planar elastic rod with a contact force, for judging the centreline: not the fit's own model."""

import numpy as np


def pressed_rod(curvature, force=0.0, contact=60.0, length=92.0, rigid=4.0):
    """Heights, places (n, 2) and directions of a rod with even own curvature [1/mm], pressed at one height.

    force : contact force over bending stiffness [1/mm^2], square to the rod
    """
    heights = np.linspace(0, length, 921)
    pitch = heights[1]
    inside = np.minimum(heights - rigid, length - rigid - heights)
    bends = np.clip(inside / pitch + 0.5, 0, 1)
    touched = int(np.argmin(np.abs(heights - contact)))
    angle = np.zeros(heights.size)
    for _ in range(400):
        x, z = summed(-np.sin(angle), pitch), summed(np.cos(angle), pitch)
        push = force * np.array([np.cos(angle[touched]), np.sin(angle[touched])])
        moment = -((z[touched] - z) * push[0] - (x[touched] - x) * push[1])
        bending = bends * (curvature + np.where(heights <= contact, moment, 0.0))
        angle = 0.7 * angle + 0.3 * summed(bending, pitch)
    return heights, np.column_stack([x, z]), angle


def summed(values, pitch):
    return np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * pitch)])


def grasps(count):
    """Rods of random own curvature, two of three pressed somewhere, and the generator that drew them."""
    rng = np.random.default_rng(3)
    for index in range(count):
        curvature = rng.uniform(0.002, 0.015) * rng.choice([-1, 1])
        force = rng.uniform(-2e-4, 3e-4) * np.sign(curvature) * (index % 3 > 0)
        yield pressed_rod(curvature, force, rng.uniform(40, 86)), rng
