"""When the simulated autopilot takes over: a ground station that fell silent, a battery that runs down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters

Takeover = Literal["RTL", "LAND", "none"]
GCS_ACTIONS: dict[int, Takeover] = {1: "RTL", 2: "RTL", 3: "RTL", 4: "RTL", 5: "LAND", 6: "RTL", 7: "RTL"}
"""FS_GCS_ENABLE"""
BATTERY_ACTIONS: dict[int, Takeover] = {1: "LAND", 2: "RTL", 3: "RTL", 4: "RTL", 5: "LAND", 6: "RTL", 7: "LAND"}
"""BATT_FS_LOW_ACT, BATT_FS_CRT_ACT"""
LOW_FOR_S = 10.0
"""BATT_LOW_TIMER"""


@dataclass(frozen=True, slots=True)
class FailsafeFinding:
    severity: int
    """MAV_SEVERITY's scale: 0 emergency to 7 debug"""
    text: str
    takeover: Takeover = "none"


class GcsFailsafe:
    """Silence is counted in the ground station's time: simulated time over the speed-up."""

    def __init__(self, speedup: float) -> None:
        self._speedup = speedup
        self._heard_s: float | None = None
        self.active = False

    def heard(self, now_s: float) -> None:
        self._heard_s = now_s

    def check(self, parameters: Parameters, now_s: float) -> FailsafeFinding | None:
        """What has changed. A ground station never heard cannot be missed."""
        action = GCS_ACTIONS.get(int(parameters["FS_GCS_ENABLE"]))
        if self._heard_s is None or action is None:
            self.active = False
            return None
        silent = (now_s - self._heard_s) / self._speedup > parameters["FS_GCS_TIMEOUT"]
        if silent == self.active:
            return None
        self.active = silent
        return FailsafeFinding(4, "GCS Failsafe", action) if silent else FailsafeFinding(4, "GCS Failsafe Cleared")


class BatteryFailsafe:
    """Low, then critical; never taken back."""

    def __init__(self) -> None:
        self.level = 0
        self._low_since: list[float | None] = [None, None]

    @property
    def active(self) -> bool:
        return self.level > 0

    def check(
        self, parameters: Parameters, voltage_v: float, used_mah: float, *, flying: bool, now_s: float
    ) -> FailsafeFinding | None:
        left_mah = parameters["BATT_CAPACITY"] - used_mah
        found = None
        for level, name in ((1, "LOW"), (2, "CRT")):
            volt, mah = parameters[f"BATT_{name}_VOLT"], parameters[f"BATT_{name}_MAH"]
            low = self._lasting(level - 1, volt > 0 and voltage_v < volt, now_s) or (mah > 0 and left_mah < mah)
            if low and level > self.level and flying:
                self.level = level
                word = "low" if level == 1 else "critical"
                text = f"Battery 1 is {word} {voltage_v:.2f}V used {used_mah:.0f} mAh"
                found = FailsafeFinding(4, text, BATTERY_ACTIONS.get(int(parameters[f"BATT_FS_{name}_ACT"]), "none"))
        return found

    def _lasting(self, index: int, low: bool, now_s: float) -> bool:
        since = self._low_since[index]
        if not low:
            self._low_since[index] = None
        elif since is None:
            self._low_since[index] = now_s
        return low and since is not None and now_s - since >= LOW_FOR_S
