"""Settings of the controllers and of the loop: band, hold, patience, how a pulse is chosen."""

from __future__ import annotations

from pydantic import Field

from tubefoot.config import Settings


class GoalSettings(Settings):
    """When a motion counts as settled, and when it is given up."""

    band_deg: float = Field(default=1.0, gt=0, le=20)
    """Error within which the finger counts as there (the paper's)."""
    hold_s: float = Field(default=2.0, gt=0, le=600)
    """How long the pump then stands (the paper's)."""
    pulses_max: int = Field(default=30, ge=1, le=1000)
    """A motion that takes more pulses is given up."""
    time_max_s: float = Field(default=120.0, gt=0, le=3600)
    """A motion that takes longer is given up."""


class PaperSettings(Settings):
    """The paper's controller: a pulse in proportion to the error, a pause, the next."""

    duty: float = Field(default=0.6, gt=0, le=1)
    """Of every pulse."""
    seconds_per_deg: float = Field(default=0.05, gt=0, le=1)
    """Pulse duration for each degree of error."""
    pulse_min_s: float = Field(default=0.03, ge=0.001, le=5)
    """Shortest pulse."""
    pulse_max_s: float = Field(default=0.3, gt=0, le=10)
    """Longest pulse."""
    settle_s: float = Field(default=0.5, ge=0, le=60)
    """Pause after each pulse before the angle counts (the paper's)."""


class AdaptiveSettings(Settings):
    """Our controller: pulses by the learnt model."""

    fill_duty_max: float = Field(default=0.9, gt=0, le=1)
    """Of long pulses, where the pressure allows it."""
    fill_duty_min: float = Field(default=0.38, gt=0, le=1)
    """Of the slowest ones, still above the dead zone of most pumps: the wall creeps along, less pressure."""
    running_duty_min: float = Field(default=0.2, gt=0, le=1)
    """To which the duty of a pump that turns already may fall, where the pressure asks for it."""
    pressure_reserve_kpa: float = Field(default=5.0, ge=0, le=50)
    """A long pulse is planned to stay so far below the guard's limit."""
    trim_duty: float = Field(default=0.9, gt=0, le=1)
    """Of short pulses: far from the pump's dead zone, so that their volume is known well."""
    trim_max_s: float = Field(default=0.25, gt=0, le=5)
    """Longest pulse at `trim_duty`."""
    trim_scatter: float = Field(default=0.06, ge=0, le=1)
    """Scatter of what a short pulse moves, relative, where the pump's gain is known."""
    arrive_s: float = Field(default=1.0, ge=0.2, le=60)
    """How long after a long pulse the creep may take to bring the finger to the target."""
    arrive_deg: float = Field(default=0.5, ge=-20, le=20)
    """How far past the target that creep may lead."""
    plan_error_deg: float = Field(default=0.25, gt=0, le=20)
    """Mean error foreseen in a hold that costs nothing; less than is asked: pulses are not exact."""
    overshoot_deg: float = Field(default=0.65, gt=0, le=20)
    """Overshoot that a plan allows."""
    pulse_worth_s: float = Field(default=0.3, ge=0, le=60)
    """Time to the hold that one more pulse must save, of the first three of a motion."""
    further_worth_s: float = Field(default=2.0, ge=0, le=60)
    """The same for further pulses."""
    rest_s: float = Field(default=0.2, ge=0, le=10)
    """Least pause between pulses: pump and tube come to rest, the model learns."""


class TrackingSettings(Settings):
    """Continuous tracking of a trajectory."""

    ahead_s: float = Field(default=0.2, ge=0.05, le=5)
    """How far ahead the finger is brought onto the trajectory."""
    least_duty: float = Field(default=0.35, gt=0, le=1)
    """Slower than this the pump is driven in bursts, away from its dead zone."""
    burst_s: float = Field(default=0.1, ge=0.02, le=1)
    """Longest run without a new command: the pump stops by itself when the host stalls."""
    quiet_deg_per_s: float = Field(default=0.05, ge=0, le=10)
    """Rate of the relaxed angle below which the pump stands."""


class GuardSettings(Settings):
    """What the loop watches, whoever decides."""

    margin_kpa: float = Field(default=4.0, ge=0, le=50)
    """The pump is stopped so far before the rig's pressure limits."""
    relax_kpa: float = Field(default=6.0, ge=0, le=50)
    """A further pulse that way may start only so much below that."""
    pressed_max_s: float = Field(default=40.0, gt=0, le=3600)
    """A motion that the pressure limits have held back for so long, in sum, is out of reach."""
    blind_s: float = Field(default=0.12, ge=0.02, le=1)
    """Without a measured angle for so long, the pump is stopped and none is started."""
    patience_s: float = Field(default=3.0, ge=0, le=600)
    """Blind for so long, the motion is given up."""
    still_ml: float = Field(default=0.15, gt=0, le=100)
    """Volume one way by which pressures or angle must have answered."""
    still_kpa: float = Field(default=0.8, gt=0, le=50)
    """Change of pressure that counts as an answer."""
    stuck_kpa: float = Field(default=0.05, gt=0, le=10)
    """A sensor whose readings stay within this range while the pump runs is stuck: noise alone is more."""
    relaxing_kpa: float = Field(default=1.5, gt=0, le=50)
    """Change of one branch with the pump standing by which the other's sensor must have moved too."""
    volume_excess: float = Field(default=3.0, gt=1, le=100)
    """A leak is suspected when so many times the foreseen volume has been pumped."""


class BendSettings(Settings):
    """All settings of closed-loop bending."""

    goal: GoalSettings = GoalSettings()
    guard: GuardSettings = GuardSettings()
    paper: PaperSettings = PaperSettings()
    adaptive: AdaptiveSettings = AdaptiveSettings()
    tracking: TrackingSettings = TrackingSettings()

    @property
    def planned_margin_kpa(self) -> float:
        """How far below the rig's limit a long pulse is planned to stay."""
        return self.guard.margin_kpa + self.adaptive.pressure_reserve_kpa
