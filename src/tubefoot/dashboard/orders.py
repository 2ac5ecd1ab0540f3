"""The orders that the page may give, by the word in their key `do`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tubefoot.config import parse_settings
from tubefoot.dashboard.calibrating import CalibrateOrder
from tubefoot.dashboard.campaigns import PlayOrder
from tubefoot.dashboard.chores import ClearOrder, PulseOrder, ZeroOrder
from tubefoot.dashboard.motions import BendOrder, FollowOrder

AnyOrder = BendOrder | FollowOrder | PulseOrder | ZeroOrder | ClearOrder | PlayOrder | CalibrateOrder
ORDERS: dict[str, type[AnyOrder]] = {
    "bend": BendOrder,
    "follow": FollowOrder,
    "pulse": PulseOrder,
    "zero": ZeroOrder,
    "clear": ClearOrder,
    "play": PlayOrder,
    "calibrate": CalibrateOrder,
}


def parse_order(table: Mapping[str, Any]) -> AnyOrder | None:
    """The order in a message, checked; None where its word is no order.

    table : of the message, with the key `do`
    """
    kind = ORDERS.get(str(table.get("do")))
    return None if kind is None else parse_settings(dict(table), kind, source="order")
