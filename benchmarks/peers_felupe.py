"""FElupe: the load case in its mixed three-field form, in a process of its own.

`python -m benchmarks.peers_felupe CASE.npz OUT.npz INCREMENTS FORM`. Nothing of ours is used here. The
linear solver is MKL PARDISO, which FElupe recommends; its default, SuperLU, is slower.
"""

import json
import sys
from pathlib import Path

import numpy as np

from benchmarks.finger_load import FingerLoad, PeerRun
from benchmarks.measured import run_measured

KINDS = {
    "hexahedron8": "hexahedron8",  # constant pressure and volume ratio in each cell
    "hexahedron27": "hexahedron27",  # trilinear pressure and volume ratio in each cell
    "hexahedron27 continuous": "hexahedron27",  # trilinear, continuous: Taylor-Hood
    "tetra10": "tetra10",  # linear, continuous: Taylor-Hood
}
"""Forms, and the cells that they take."""


def run_finger(load: FingerLoad, form: str, increments: float, directory: Path, threads: int) -> PeerRun:
    """Solve the load case in a directory, in equal increments."""
    directory.mkdir(parents=True, exist_ok=True)
    case, out, log = load.save(directory / "case.npz"), directory / "out.npz", directory / "felupe.log"
    out.unlink(missing_ok=True)
    command = [
        sys.executable,
        "-m",
        "benchmarks.peers_felupe",
        str(case),
        str(out),
        str(round(increments)),
        form,
    ]
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    usage = run_measured(command, log, environment=dict.fromkeys(names, str(threads)))
    text = log.read_text(errors="replace").strip()
    if usage.code != 0:
        return PeerRun(usage, 0, None, text.splitlines()[-1] if text else f"exit code {usage.code}")
    found = np.load(out)
    return PeerRun(usage, int(found["iterations"]), found["displacements"])


def solve(case: Path, out: Path, increments: int, form: str) -> None:
    """Read a case, solve it, write displacements and the number of iterations."""
    import felupe as fem
    import felupe.constitution.tensortrax as mat
    from pypardiso import spsolve

    data = np.load(case)
    names = {"hexahedron8": "hexahedron", "tetra10": "tetra10"}
    mesh = fem.Mesh(data["points"], data["cells"], names.get(str(data["kind"]), str(data["kind"])))
    regions = {
        "hexahedron8": (fem.RegionHexahedron, fem.RegionHexahedronBoundary),
        "hexahedron27": (fem.RegionTriQuadraticHexahedron, fem.RegionTriQuadraticHexahedronBoundary),
    }
    region_kind, boundary_kind = regions[KINDS[form]]
    space = {"disconnect": False} if form.endswith("continuous") else {}
    field = fem.FieldsMixed(region_kind(mesh), n=3, **space)
    ogden = mat.Hyperelastic(
        mat.models.hyperelastic.ogden, mu=data["mu"].tolist(), alpha=data["alpha"].tolist()
    )
    body = fem.SolidBody(fem.NearlyIncompressible(ogden, bulk=float(data["bulk"])), field)
    boundaries = {
        f"held_{axis}": fem.Boundary(field[0], mask=data["held"][:, axis], skip=np.arange(3) != axis)
        for axis in range(3)
    }
    loads, ramp = [], {}
    for hand, pressure in zip(("right", "left"), data["pressures"], strict=True):
        wall = boundary_kind(mesh, mask=np.isin(np.arange(mesh.npoints), data[f"wall_{hand}"]))
        if len(wall.mesh.cells) != len(data[f"wall_{hand}"]):
            raise AssertionError(f"the {hand} wall has {len(wall.mesh.cells)} faces")
        load = fem.SolidBodyPressure(fem.FieldContainer([fem.Field(wall, dim=3)]))
        loads.append(load)
        ramp[load] = pressure * np.linspace(0.0, 1.0, increments + 1)[1:]
    step = fem.Step(items=[body, *loads], ramp=ramp, boundaries=boundaries)
    iterations = []
    job = fem.Job(steps=[step], callback=lambda _step, _substep, found: iterations.append(found.iterations))
    job.evaluate(solver=spsolve, verbose=False)
    print(json.dumps(iterations))
    np.savez(out, displacements=field[0].values, iterations=sum(iterations))


if __name__ == "__main__":
    solve(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
