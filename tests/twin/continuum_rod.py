"""A planar continuum rod, the oracle of the finger's chain: its own equations, NumPy only.

theta' = kappa(m) over the bellows and 0 in the caps, x' = -sin theta, z' = cos theta; the moment at s is
that of tip force and of the weight beyond s about the point at s. Solved by relaxation: moments from the
last shape, then the shape from the moments.
"""

import numpy as np


def rod_shape(curvature, length, caps, masses, gravity=(0.0, 0.0), tip_force=(0.0, 0.0), cells=2000):
    """(x, z, theta) at the nodes of a rod clamped at s = 0, theta positive towards -x.

    curvature : moment [N mm] -> curvature [1/mm], for arrays
    length, caps : of the rod and of its rigid ends [mm]
    masses : of the bellows and of a cap, spread evenly [t]; gravity : along x and z [mm/s^2]; tip_force : [N]
    """
    s = np.linspace(0.0, length, cells + 1)
    pitch = s[1]
    bends = ((s[:-1] + s[1:]) / 2 > caps) & ((s[:-1] + s[1:]) / 2 < length - caps)
    mass = np.where(bends, masses[0] / bends.sum(), masses[1] / ((~bends).sum() / 2))
    theta = np.zeros(cells)
    for _ in range(500):
        x = np.concatenate([[0.0], np.cumsum(-np.sin(theta) * pitch)])
        z = np.concatenate([[0.0], np.cumsum(np.cos(theta) * pitch)])
        middle_x, middle_z = (x[1:] + x[:-1]) / 2, (z[1:] + z[:-1]) / 2
        # Weight beyond a cell: sums from the tip. Bending towards -x: (x - c_x) f_z - (z - c_z) f_x.
        beyond, beyond_x, beyond_z = (
            np.cumsum((mass * each)[::-1])[::-1] for each in (1.0, middle_x, middle_z)
        )
        moment = gravity[1] * (beyond_x - middle_x * beyond) - gravity[0] * (beyond_z - middle_z * beyond)
        moment += (x[-1] - middle_x) * tip_force[1] - (z[-1] - middle_z) * tip_force[0]
        turned = np.concatenate([[0.0], np.cumsum(np.where(bends, curvature(moment), 0.0) * pitch)])
        new = (turned[1:] + turned[:-1]) / 2
        if np.abs(new - theta).max() < 1e-11:
            return x, z, turned
        theta = 0.5 * theta + 0.5 * new
    raise AssertionError("the rod did not settle")
