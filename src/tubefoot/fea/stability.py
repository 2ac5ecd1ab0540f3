"""Whether an equilibrium is stable while the pump stands still, and by which displacement it is not.

With the path parameter fixed, an equilibrium is stable when the bordered tangent has as many negative
eigenvalues as at rest, where they belong to the pressures. Each further one is a direction in which the
energy falls: the model counts them by the signs of the factors' pivots (Sylvester's law of inertia). The
eigenvalue closest to zero, of A x = w M x with M the volumes of the nodes, is found by inverse iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tubefoot.fea.equilibrium import Model
from tubefoot.fea.items import State

FloatArray = NDArray[np.float64]

ITERATIONS = 60
ACCURATE = 1e-3
"""Relative change of the critical eigenvalue at which it is known well enough."""
BLOCK = 8
"""Modes iterated at a time: a finger's soft bending lies closer to zero than the buckling of a fold."""


@dataclass(frozen=True)
class CriticalMode:
    """The displacement to which the structure resists least.

    stiffness : its eigenvalue [N/mm per mm^3 of the solid], negative where the energy falls along it
    shape : (n_points, 3), largest displacement 1; unstable : number of directions in which the energy falls
    """

    stiffness: float
    shape: FloatArray
    unstable: int | None


def nodal_volumes(model: Model) -> FloatArray:
    """Share of the solids that belongs to each point [mm^3], (n_points,): each cell's volume spread evenly.

    model : whose solids
    """
    shares = np.zeros(len(model.mesh.points))
    for solid in model.solids:
        nodes = solid.block.nodes
        np.add.at(shares, nodes, solid.weights.sum(axis=1)[:, None] / nodes.shape[1])
    return shares


def critical_mode(model: Model, state: State) -> CriticalMode:
    """The critical mode of an equilibrium at a fixed path parameter.

    model : what was solved; state : an equilibrium of it
    """
    unstable = model.linearise(state)
    mass = np.zeros(model.n_unknowns)
    free = model.system.free[model.system.free < model.mesh.points.size]
    mass[free] = np.repeat(nodal_volumes(model), 3)[free]
    block = np.random.default_rng(0).standard_normal((BLOCK, model.n_unknowns))
    values = np.full(BLOCK, np.inf)
    for _ in range(ITERATIONS):
        moved = np.array([model.response(mass * shape).unknowns for shape in block])
        # Rayleigh quotients in the block's space, since A moved = M block.
        before = values
        values, turns = _ritz((moved * mass) @ block.T, (moved * mass) @ moved.T)
        block = turns.T @ moved
        critical = int(np.argmin(values)) if values.min() < 0.0 else 0
        if abs(values[critical] - before[critical]) < ACCURATE * abs(values[critical]):
            break
    shape = block[critical, : model.mesh.points.size].reshape(-1, 3)
    return CriticalMode(float(values[critical]), shape / np.abs(shape).max(), unstable)


def place_of(model: Model, mode: CriticalMode) -> str:
    """Region and rest position of the largest displacement of a mode, in words.

    model : whose; mode : its mode
    """
    mesh = model.mesh
    point = int(np.argmax(np.linalg.norm(mode.shape, axis=1)))
    regions = {
        mesh.regions[k].replace("_", " ")
        for block in mesh.blocks
        for k in block.region[(block.nodes == point).any(axis=1)]
    }
    x, y, z = mesh.points[point]
    return f"in {' and '.join(sorted(regions))} at x = {x:.1f}, y = {y:.1f}, z = {z:.1f} mm"


def _ritz(stiffness: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues by rising size and vectors of a small symmetric pair."""
    root = np.linalg.cholesky(0.5 * (size + size.T))
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ (0.5 * (stiffness + stiffness.T)) @ inverse.T)
    order = np.argsort(np.abs(values))
    return values[order], (inverse.T @ vectors)[:, order]
