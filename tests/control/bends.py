"""A bench and a loop about it, in one call."""

from tubefoot.control.adaptive import AdaptiveController
from tubefoot.control.creep import creep_law
from tubefoot.control.loop import BendLoop
from tubefoot.control.paper import PaperController
from tubefoot.control.settings import BendSettings
from tubefoot.lab.sensing import measure_neutral
from tubefoot.reduced.files import reference_file
from tubefoot.twin.bench import VirtualBench
from tubefoot.units import DEG, KPA


def reference_law():
    reference = reference_file()
    return creep_law(reference.to_finger(), reference.to_prony())


def controller(name, target_deg, settings=None, rig=None):
    settings = settings or BendSettings()
    if name == "paper":
        return PaperController(target_deg * DEG, settings.goal, settings.paper)
    pump, limits = rig.pump, rig.rig_limits()
    most = limits.pressure_high - settings.planned_margin_kpa * KPA
    return AdaptiveController(target_deg * DEG, reference_law(), pump, most, settings.goal, settings.adaptive)


def bent(
    target_deg,
    name="adaptive",
    settings=None,
    foreseen=float("inf"),
    watch=lambda row: None,
    make=None,
    **bench,
):
    """A motion on a bench with some faults; the bench has been looked at after it as `after`."""
    settings = settings or BendSettings()
    with VirtualBench(make, board="native", **bench) as virtual:
        virtual.rig.connect()
        measure_neutral(virtual.rig)
        virtual.angles.open()
        loop = BendLoop(
            virtual.rig,
            virtual.angles,
            settings,
            watch=watch,
            further=lambda: {"true_deg": virtual.truth().bend / DEG, "flow": virtual.truth().pump_flow},
        )
        motion = loop.run(controller(name, target_deg, settings, virtual.rig_settings), foreseen)
        virtual.clock.sleep(1.0)
        motion.after = virtual.truth()
    return motion
