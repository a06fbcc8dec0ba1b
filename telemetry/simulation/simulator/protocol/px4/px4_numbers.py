"""PX4's flight modes as a heartbeat's ``custom_mode`` has them: a main mode, and a sub mode of AUTO."""

from __future__ import annotations

AUTO = 4
_MAIN = {"MANUAL": 1, "ALTCTL": 2, "POSCTL": 3, "ACRO": 5, "OFFBOARD": 6, "STABILIZED": 7}
_SUB = {"TAKEOFF": 2, "HOLD": 3, "MISSION": 4, "RTL": 5, "LAND": 6}
MODE_NUMBERS: dict[str, int] = {
    **{name: main << 16 for name, main in _MAIN.items()},
    **{name: AUTO << 16 | sub << 24 for name, sub in _SUB.items()},
}
MODE_NAMES = {number: name for name, number in MODE_NUMBERS.items()}


def name_of(main: int, sub: int) -> str | None:
    return MODE_NAMES.get(main << 16 | (sub << 24 if main == AUTO else 0))
