"""Print files: time, memory and size of an export in a fresh process, by number of units.

The time is CPU time of the whole process, start-up included: on an undisturbed core it is the wall time, and
on a shared one it still compares.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.row import Row

UNITS = (3, 6, 12)
TARGET_S = 30.0
"""Twelve units are to be exported within this time."""
CHILD = """
import json, resource, sys
from pathlib import Path
from tubefoot.cli.design import export
export(Path(sys.argv[1]), out=Path(sys.argv[2]), pictures=sys.argv[3] == "pictures")
own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
cpu = sum(used.ru_utime + used.ru_stime for used in (own, children))
print(json.dumps({"cpu_s": cpu, "memory_mb": own.ru_maxrss / 1024}))
"""


def run() -> list[Row]:
    rows = []
    for units in UNITS:
        design = Path("examples/designs") / f"reference-{units}.toml"
        for pictures in ("pictures", "plain"):
            rows += _export(design, units, pictures)
    return rows


def _export(design: Path, units: int, pictures: str) -> list[Row]:
    with tempfile.TemporaryDirectory() as directory:
        started = time.perf_counter()
        child = subprocess.run(
            [sys.executable, "-c", CHILD, str(design), directory, pictures],
            capture_output=True,
            text=True,
            check=True,
        )
        wall = time.perf_counter() - started
        size = sum(path.stat().st_size for path in Path(directory).rglob("*") if path.is_file())
    used = json.loads(child.stdout.splitlines()[-1])
    target = TARGET_S if units == max(UNITS) else None
    name = f"export, {units} units" + (" with pictures" if pictures == "pictures" else "")
    cpu = used["cpu_s"]
    note = f"wall {wall:.1f} s, {used['memory_mb']:.0f} MB, files {size / 1e6:.1f} MB"
    return [Row(name, cpu, target, "target" if target else "", target and target / cpu, "CPU s", note)]
