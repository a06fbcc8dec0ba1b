"""The simulated autopilot's parameters, by ArduCopter's names, in its units and with its defaults."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from planning.flight_time.scurve import Axes

Kind = Literal["int8", "int16", "int32", "float"]


@dataclass(frozen=True, slots=True)
class Spec:
    kind: Kind
    default: float
    low: float = -math.inf
    high: float = math.inf


SPECS: dict[str, Spec] = {
    "ANGLE_MAX": Spec("int16", 3000, 1000, 8000),
    "ARMING_CHECK": Spec("int32", 1),
    "BATT_CAPACITY": Spec("int32", 9000, 100, 1_000_000),
    "BATT_CRT_MAH": Spec("float", 0, 0),
    "BATT_CRT_VOLT": Spec("float", 0, 0),
    "BATT_FS_CRT_ACT": Spec("int8", 0, 0, 7),
    "BATT_FS_LOW_ACT": Spec("int8", 0, 0, 7),
    "BATT_LOW_MAH": Spec("float", 0, 0),
    "BATT_LOW_VOLT": Spec("float", 10.5, 0),
    "BATT_MONITOR": Spec("int8", 4),
    "COMPASS_USE": Spec("int8", 1),
    "DISARM_DELAY": Spec("int8", 10, 0, 127),
    "FENCE_ACTION": Spec("int8", 1, 0, 5),
    "FENCE_ALT_MAX": Spec("float", 100),
    "FENCE_ALT_MIN": Spec("float", -10),
    "FENCE_ENABLE": Spec("int8", 0),
    "FENCE_MARGIN": Spec("float", 2),
    "FENCE_RADIUS": Spec("float", 300),
    "FENCE_TOTAL": Spec("int8", 0),
    "FENCE_TYPE": Spec("int8", 7, 0, 15),
    "FLTMODE1": Spec("int8", 7),
    "FLTMODE2": Spec("int8", 9),
    "FLTMODE3": Spec("int8", 6),
    "FLTMODE4": Spec("int8", 3),
    "FLTMODE5": Spec("int8", 5),
    "FLTMODE6": Spec("int8", 0),
    "FLTMODE_CH": Spec("int8", 5),
    "FRAME_CLASS": Spec("int8", 1),
    "FRAME_TYPE": Spec("int8", 0),
    "FS_GCS_ENABLE": Spec("int8", 0, 0, 7),
    "FS_GCS_TIMEOUT": Spec("float", 5, 2, 120),
    "FS_THR_ENABLE": Spec("int8", 1),
    "GUID_OPTIONS": Spec("int32", 0, 0),
    "GUID_TIMEOUT": Spec("float", 3, 0.1, 5),
    "LAND_ALT_LOW": Spec("float", 1000, 100, 10000),
    "LAND_SPEED": Spec("float", 50, 30, 200),
    "LAND_SPEED_HIGH": Spec("float", 0, 0, 500),
    "MAV_GCS_SYSID": Spec("int16", 255, 1, 255),
    "MAV_SYSID": Spec("int16", 1, 1, 255),
    "MIS_RESTART": Spec("int8", 0, 0, 1),
    "MIS_TOTAL": Spec("int16", 0),
    "PILOT_SPEED_UP": Spec("float", 250, 50, 500),
    "RALLY_TOTAL": Spec("int8", 0),
    "RTL_ALT": Spec("int32", 1500, 30, 300_000),
    "RTL_ALT_FINAL": Spec("float", 0, 0, 1000),
    "RTL_CLIMB_MIN": Spec("float", 0, 0, 3000),
    "RTL_CONE_SLOPE": Spec("float", 3, 0, 10),
    "RTL_LOIT_TIME": Spec("int32", 5000, 0, 60000),
    "RTL_SPEED": Spec("float", 0, 0, 2000),
    "SIM_WIND_DIR": Spec("float", 180, 0, 360),
    "SIM_WIND_SPD": Spec("float", 0, 0, 40),
    "SYSID_THISMAV": Spec("int16", 1, 1, 255),
    "WPNAV_ACCEL": Spec("float", 250, 50, 500),
    "WPNAV_ACCEL_C": Spec("float", 0, 0, 500),
    "WPNAV_ACCEL_Z": Spec("float", 100, 50, 500),
    "WPNAV_JERK": Spec("float", 1, 0.2, 20),
    "WPNAV_RADIUS": Spec("float", 200, 5, 1000),
    "WPNAV_SPEED": Spec("float", 1000, 10, 2000),
    "WPNAV_SPEED_DN": Spec("float", 150, 10, 500),
    "WPNAV_SPEED_UP": Spec("float", 250, 10, 1000),
    "WP_YAW_BEHAVIOR": Spec("int8", 2, 0, 3),
}
SAME = {"SYSID_THISMAV": "MAV_SYSID", "MAV_SYSID": "SYSID_THISMAV"}
"""One thing under the names of ArduCopter 4.6 and 4.7."""


class Parameters:
    """A table that keeps to its ranges; whole numbers stay whole. ``specs``: of another autopilot."""

    def __init__(self, specs: Mapping[str, Spec] = SPECS, /, **changed: float) -> None:
        self.specs = specs
        self._values = {name: spec.default for name, spec in specs.items()}
        self._axes: tuple[float | None, Axes] | None = None
        """For the speed that was asked for last: it is, again and again, in every step of a flight."""
        for name, value in changed.items():
            self.set(name, value)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def set(self, name: str, value: float) -> float:
        """The value that is kept: cut to the parameter's range; NaN changes nothing."""
        spec = self.specs[name]
        if math.isfinite(value):
            kept = min(max(value, spec.low), spec.high)
            self._values[name] = kept if spec.kind == "float" else float(round(kept))
            self._axes = None
            if name in SAME and SAME[name] in self.specs:
                self._values[SAME[name]] = self._values[name]
        return self._values[name]

    def axes(self, speed_m_s: float | None = None) -> Axes:
        """What navigation may ask for; ``speed_m_s`` replaces WPNAV_SPEED."""
        if self._axes is not None and self._axes[0] == speed_m_s:
            return self._axes[1]
        accel_m_s2 = self["WPNAV_ACCEL"] / 100
        corner_m_s2 = self["WPNAV_ACCEL_C"] / 100
        axes = Axes(
            speed_m_s=speed_m_s or self["WPNAV_SPEED"] / 100,
            climb_m_s=self["WPNAV_SPEED_UP"] / 100,
            descent_m_s=self["WPNAV_SPEED_DN"] / 100,
            accel_m_s2=accel_m_s2,
            vertical_accel_m_s2=self["WPNAV_ACCEL_Z"] / 100,
            corner_accel_m_s2=corner_m_s2 or 2 * accel_m_s2,
            jerk_m_s3=self["WPNAV_JERK"],
        )
        self._axes = speed_m_s, axes
        return axes
