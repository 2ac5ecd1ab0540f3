"""Our own solves for the benchmark, each in a process of its own; the last line printed is JSON.

`python -m benchmarks.ours_fea solve DESIGN OUT`: what `tubefoot solve` does by default.
`python -m benchmarks.ours_fea pressures DESIGN MESH RIGHT LEFT SHARE ...`: prescribed chamber pressures
[kPa], or the given shares of them one after the other, on a mesh named as in `divisions_named`; to compare
with programs that have no coupled chambers.
`python -m benchmarks.ours_fea rates DESIGN MESH`: floating-point rates of the factorisation and the machine.
`python -m benchmarks.ours_fea work UNITS`: unknowns, entries and operations of one factorisation, contact on.
`python -m benchmarks.ours_fea curve UNITS OUT`: the curve of a finger with any number of units to 35 kPa.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks.finger_load import HANDS, FingerLoad, load_case
from benchmarks.measured import Usage, run_measured
from tubefoot.design.finger import FingerDesign
from tubefoot.fea.cavity import Cavity
from tubefoot.fea.drive import Control, Drive
from tubefoot.fea.equilibrium import Model
from tubefoot.fea.finger_mesh import clamp_half_finger
from tubefoot.fea.finger_model import ogden_law
from tubefoot.fea.landing import Limit
from tubefoot.fea.path import follow
from tubefoot.fea.solid import Solid
from tubefoot.fea.stride import StepControl

STATES = 3
"""Into how many increments a load is cut: the fewest that converge."""
DENSE_SIZE = 3000
"""Rows of the matrices that the machine's dense rate is measured with."""


def run_ours(arguments: list[str], log: Path, threads: int, **environment: str) -> tuple[Usage, dict]:
    """Measure one of this module's commands in a process of its own; what it printed last comes along."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    settings = dict.fromkeys(names, str(threads)) | environment
    usage = run_measured([sys.executable, "-m", "benchmarks.ours_fea", *arguments], log, environment=settings)
    text = log.read_text(errors="replace").strip()
    if usage.code != 0:
        raise RuntimeError(f"our solve {' '.join(arguments)} failed:\n{text}")
    return usage, json.loads(text.splitlines()[-1])


def solve(design: str, out: str) -> dict:
    from tubefoot.design.finger import load_design
    from tubefoot.fea.solve import solve_design

    return solve_design(load_design(design), out).summary


def work(units: str) -> dict:
    """What one factorisation of a finger takes; independent of the machine and its load."""
    from tubefoot.fea.finger_model import SolveSettings, build_finger

    model = build_finger(_finger(units), SolveSettings()).model
    model.evaluate(model.rest())
    model.solver.factorise(model.system.data)
    solver = model.solver
    return {"unknowns": model.system.size, "nonzeros": solver.nonzeros, "flops": solver.flops}


def curve(units: str, out: str) -> dict:
    from tubefoot.fea.solve import solve_design

    return solve_design(_finger(units), out).summary


def _finger(units: str) -> FingerDesign:
    from benchmarks.peers import DESIGN
    from tubefoot.design.finger import load_design

    return load_design(DESIGN).with_bellows(units=int(units))


def pressures(design: str, mesh: str, right: str, left: str, *shares: str) -> dict:
    load, model = _model(design, mesh, float(right), float(left))
    bends, steps = [], []
    for share in map(float, shares):
        goal = Limit(Control("parameter", share), "load reached")
        steps = follow(model, goal, stepping=StepControl(states=STATES), known=steps).steps
        bends.append(load.bend_deg(steps[-1].state.unknowns[: load.mesh.points.size].reshape(-1, 3)))
    return {
        "bend_deg": bends,
        "unknowns": model.system.size,
        "iterations": sum(step.iterations for step in steps),
        "seconds": asdict(model.timings),
    }


def rates(design: str, mesh: str) -> dict:
    """Rates [GFLOP/s] of the numerical factorisation and of a dense product, on the same threads."""
    _, model = _model(design, mesh, 1.0, -1.0)
    model.evaluate(model.rest())
    model.solver.factorise(model.system.data)
    flops = model.solver.flops or np.nan
    a = np.random.default_rng(0).random((DENSE_SIZE, DENSE_SIZE))
    return {
        "gflop": flops / 1e9,
        "factor_gflops": flops / _best(lambda: model.solver.factorise(model.system.data)) / 1e9,
        "dense_gflops": 2.0 * DENSE_SIZE**3 / _best(lambda: a @ a) / 1e9,
    }


def _model(design: str, mesh: str, right: float, left: float) -> tuple[FingerLoad, Model]:
    load = load_case(Path(design), mesh, "hexahedron27", (right, left))
    solid = Solid(load.mesh, {"*": ogden_law(load.design.body)}, pressure="continuous")
    cavities = [Cavity(load.mesh, f"cavity_{hand}", k) for k, hand in enumerate(HANDS)]
    drive = Drive(("pressure", "pressure"), load.pressures)
    return load, Model(load.mesh, [solid], clamp_half_finger(load.mesh), cavities, drive)


def _best(action: Callable[[], object], repeats: int = 5) -> float:
    """Shortest time of a few [s]."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        action()
        times.append(time.perf_counter() - started)
    return min(times)


if __name__ == "__main__":
    commands = {"solve": solve, "pressures": pressures, "rates": rates, "work": work, "curve": curve}
    command = commands[sys.argv[1]]
    print(json.dumps(command(*sys.argv[2:])))
