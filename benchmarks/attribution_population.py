"""`python -m benchmarks.attribution_population`: is the seam the main cause of the offsets, on how many
benches?

Attribution (Shapley) of angle and suction pressure on blind benches of 3 and 6 units, and how stiff the seam
of the nominal bench would have to be to become the main cause. The print's stiffness is no cause of an offset
here: it is what a fit of the material finds, and goes into the finite elements.
"""

from collections import Counter

from tubefoot.errors import ConvergenceError
from tubefoot.reduced.files import reference_file
from tubefoot.twin.bench_settings import BenchSettings
from tubefoot.validation.attribution import QUANTITIES, Attribution, attribute, values_of
from tubefoot.validation.lean_bench import LeanBench
from tubefoot.validation.virtual_experiment import hidden_bench

BENCHES = 50
SEAMS = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)
SETTLES_S = (0.5, 5.0, 60.0, 600.0)


def main_but_print(shares: dict[str, float], way: float) -> str:
    """The cause with the largest share in the way of the paper's offset, the print's stiffness aside."""
    causes = [cause for cause in shares if cause != "print's stiffness"]
    return max(causes, key=lambda cause: way * shares[cause])


def told(found: Attribution) -> str:
    """Offsets with the shares of seam, relaxation and air columns."""
    angle, suction = (found.shapley[quantity] for quantity in QUANTITIES)
    return (
        f"angle {found.offset('bend_deg'):+.2f} deg (seam {angle['seam']:+.2f}, relaxation "
        f"{angle['relaxation']:+.2f}), suction {found.offset('pressure_left_kpa'):+.2f} kPa (seam "
        f"{suction['seam']:+.2f}, relaxation {suction['relaxation']:+.2f}, air {suction['air columns']:+.2f})"
    )


def main() -> None:
    content = reference_file()
    relaxation = content.to_prony()
    for units in (3, 6):
        bench = LeanBench(content.to_finger().with_units(units))
        mains: dict[str, Counter[str]] = {quantity: Counter() for quantity in QUANTITIES}
        for seed in range(BENCHES):
            values = {**values_of(hidden_bench(seed, units)), "scale": 1.0}
            try:
                found = attribute(values, bench, relaxation)
            except ConvergenceError:
                continue
            for quantity, way in zip(QUANTITIES, (-1.0, 1.0), strict=True):
                mains[quantity][main_but_print(found.shapley[quantity], way)] += 1
        for quantity, count in mains.items():
            of = f"{units} units, {sum(count.values())} benches, {quantity}"
            print(f"{of}: {dict(count.most_common())}", flush=True)
        nominal = values_of(BenchSettings())
        for seam in SEAMS:
            found = attribute({**nominal, "seam": seam}, bench, relaxation)
            print(f"{units} units, nominal with seam {seam:.1f}: {told(found)}", flush=True)
        for settle in SETTLES_S:
            tight = {**nominal, "seam": 0.2, "leak_back_ul_per_s_kpa": 0.0}
            found = attribute(tight, bench, relaxation, settle=settle)
            print(f"{units} units, seam 0.2, no leak, after {settle:g} s: {told(found)}", flush=True)


if __name__ == "__main__":
    main()
