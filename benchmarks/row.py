"""One line of the benchmark table."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """What was measured, ours beside a peer or a limit measured in the same run.

    ratio : how many times better ours is (other / ours for times, ours / other for rates)
    """

    name: str
    ours: float
    other: float | None
    other_name: str
    ratio: float | None
    unit: str
    note: str = ""
