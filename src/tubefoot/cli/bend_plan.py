"""What a `bend` is to do: which controller, where to, with which model of the finger."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tubefoot.cli.bend_stage import Stage
    from tubefoot.control.creep import CreepLaw
    from tubefoot.control.loop import Motion
    from tubefoot.control.settings import BendSettings
    from tubefoot.control.trajectory import Trajectory
    from tubefoot.lab.settings import RigSettings

Watch = Callable[[dict[str, Any]], None]


class BendPlan:
    """What is to be done: which controller, where to, with which model of the finger."""

    def __init__(
        self,
        name: str,
        targets: list[float],
        trajectory: Trajectory | None,
        settings: BendSettings,
        law: CreepLaw,
    ):
        """Plan it; `made` does it from a command line.

        name : of the controller; targets : one after the other [deg]; trajectory : instead of targets
        settings : of controllers, goal and guard; law : of the finger
        """
        self.name, self.targets, self.trajectory = name, targets, trajectory
        self.settings, self.law = settings, law

    @classmethod
    def made(
        cls,
        name: str,
        target_deg: float | None,
        back: bool,
        trajectory: Path | None,
        settings: Path | None,
        model: Path | None,
    ) -> BendPlan:
        """The plan of a command line; ConfigError where the finger cannot bend so far.

        name : of the controller; target_deg : if not a trajectory; back : whether then to 0 deg
        trajectory, settings, model : files
        """
        import math

        from tubefoot.config import load_settings
        from tubefoot.control.creep import creep_law
        from tubefoot.control.settings import BendSettings
        from tubefoot.control.trajectory import load_trajectory
        from tubefoot.errors import ConfigError
        from tubefoot.reduced.files import read_reduced, reference_file
        from tubefoot.units import DEG

        content = read_reduced(model) if model else reference_file()
        finger = content.to_finger()
        largest = finger.n_units * finger.valid.angle / DEG
        followed = load_trajectory(trajectory) if trajectory else None
        most = abs(target_deg) if target_deg is not None else 0.0
        if followed is not None:
            most = float(abs(followed.bends).max()) / DEG
        if not math.isfinite(most) or most > largest:
            raise ConfigError(
                f"a bend of {most:g} deg is outside of the {largest:.0f} deg that `{finger.name}` was "
                "identified for; bend less, or give another --model"
            )
        targets = [] if target_deg is None else [target_deg, 0.0][: 2 if back else 1]
        read = load_settings(settings, BendSettings) if settings else BendSettings()
        return cls(name, targets, followed, read, creep_law(finger, content.to_prony()))

    def carry_out(self, stage: Stage, rig: RigSettings, motions: list[Motion], watch: Watch) -> None:
        """Run the motions, each after the one before has settled.

        stage : that they run on; rig : its settings; motions : get each as it has ended
        watch : called with every row of the trace
        """
        from tubefoot.control.choice import step_controller, volume_foreseen
        from tubefoot.control.loop import BendLoop
        from tubefoot.control.tracking import TrackingController
        from tubefoot.units import DEG

        loop = BendLoop(stage.rig, stage.angles, self.settings, stage.recorder, watch, stage.further)
        if self.trajectory is not None:
            tracking = TrackingController(self.trajectory, self.law, rig.pump, self.settings.tracking)
            motions.append(loop.run(tracking, part="trajectory", timed=False))
            return
        steps = step_controller(self.name, self.law, rig, self.settings)
        foreseen = volume_foreseen(self.law, max(abs(target) for target in self.targets) * DEG)
        for target, part in zip(self.targets, ("to target", "return"), strict=False):
            steps.aim(target * DEG)
            motions.append(loop.run(steps, foreseen, part))
            if not motions[-1].settled:
                break
