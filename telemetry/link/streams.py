"""Asks the vehicle for what the console shows, and asks again for what does not come.

ArduPilot sends no position unless it is asked. What arrives is counted instead of acknowledgements, which do not say
what they are for: so lost requests, restarts and another ground station's lower rates are all met the same way.
"""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message

CHECK_EVERY_S = 3.0
RARE_S = 12.0
"""Pauses between requests grow to this."""
ENOUGH = 0.5
"""Share of the wanted rate that is good enough."""
TRIES_OF_A_MESSAGE = 5
FEW = 4
"""Requests that go out at once: what is ordered must not stand behind twenty of them on a radio."""
LOOK_S = 1.0
"""On a way that was asked before, what still comes is counted for so long before anything is asked again."""

FAST_HZ: dict[str, float] = {
    "GLOBAL_POSITION_INT": 20,
    "ATTITUDE": 20,
    "SYS_STATUS": 2,
    "GPS_RAW_INT": 2,
    "VFR_HUD": 4,
    "MISSION_CURRENT": 4,
    "EXTENDED_SYS_STATE": 4,
    "BATTERY_STATUS": 1,
    "EKF_STATUS_REPORT": 1,
    "ESTIMATOR_STATUS": 1,
    "VIBRATION": 1,
    "SYSTEM_TIME": 1,
    "RC_CHANNELS": 5,
    "WIND": 1,
    "WIND_COV": 1,
    "FENCE_STATUS": 1,
    "HOME_POSITION": 0.5,
    "POSITION_TARGET_GLOBAL_INT": 4,
    "OBSTACLE_DISTANCE": 5,
    "DISTANCE_SENSOR": 5,
}
"""For a network."""
SLOW_HZ = {name: 10.0 if hz > 10 else min(hz, 2.0) for name, hz in FAST_HZ.items()}
"""For a serial radio: about 1.5 kB/s."""
_NEEDED = ("GLOBAL_POSITION_INT", "ATTITUDE", "SYS_STATUS", "GPS_RAW_INT", "MISSION_CURRENT")
"""Asked for until they come; the others a vehicle may not have."""
_OWN_KIND = {
    "EKF_STATUS_REPORT": "ardupilot",
    "FENCE_STATUS": "ardupilot",
    "WIND": "ardupilot",
    "ESTIMATOR_STATUS": "px4",
    "WIND_COV": "px4",
    "POSITION_TARGET_GLOBAL_INT": "px4",
}
_IDS: dict[str, int] = {kind.msgname: number for number, kind in mavlink.mavlink_map.items()}
_OLD_STREAMS = ((2, 2), (6, 20), (10, 20), (11, 4), (3, 1), (12, 1))
"""(MAV_DATA_STREAM, Hz): extended status, position, extra 1 to 3, RC channels."""


class StreamRequests:
    """Of one adopted vehicle. ``on_tick`` and ``on_message`` return the messages to be sent."""

    def __init__(self, target: tuple[int, int], autopilot: str, *, slow: bool, now_s: float) -> None:
        self._target = target
        rates = SLOW_HZ if slow else FAST_HZ
        self._wanted = {name: hz for name, hz in rates.items() if _OWN_KIND.get(name, autopilot) == autopilot}
        self._once = ["AUTOPILOT_VERSION", "HOME_POSITION"]
        self.restart(now_s)

    def restart(self, now_s: float) -> None:
        """The vehicle was adopted, or has started anew and knows nothing of what was asked."""
        self._counts = dict.fromkeys(self._wanted, 0)
        self._tries = dict.fromkeys([*self._wanted, *self._once], 0)
        self._seen_once: set[str] = set()
        self._refused_since_s: float | None = None
        self._since_s, self._next_s, self._pause_s = now_s, now_s, CHECK_EVERY_S
        self._waiting: list[Message] = []

    def go_on(self, now_s: float) -> None:
        """Its way is in use again, and the vehicle has not started anew since: only what does not come is asked for."""
        self._counts = dict.fromkeys(self._counts, 0)
        self._since_s, self._next_s, self._pause_s = now_s, now_s + LOOK_S, CHECK_EVERY_S

    def on_message(self, message: Message, now_s: float) -> None:
        name = message.get_type()
        if name in self._counts:
            self._counts[name] += 1
        if name in self._once:
            self._seen_once.add(name)
        if name == "COMMAND_ACK" and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._on_ack(message.result, now_s)

    def on_tick(self, now_s: float) -> list[Message]:
        """A few at a time, the needed ones first."""
        if now_s >= self._next_s:
            self._waiting = self._requests(now_s)
        few, self._waiting = self._waiting[:FEW], self._waiting[FEW:]
        return few

    def _requests(self, now_s: float) -> list[Message]:
        first = self._next_s == self._since_s
        missing = [name for name in self._wanted if first or self._is_short(name, now_s - self._since_s)]
        missing.sort(key=lambda name: name not in _NEEDED)
        requests = [self._interval(name) for name in missing]
        requests += [self._request(name) for name in self._once if self._is_unseen(name)]
        if self._refused_since_s is not None and any(name in _NEEDED for name in missing):
            requests += [self._old_stream(stream, hz) for stream, hz in _OLD_STREAMS]
        for name in (*missing, *self._once):
            self._tries[name] += 1
        self._counts = dict.fromkeys(self._counts, 0)
        needed = any(name in _NEEDED for name in missing)
        self._pause_s = CHECK_EVERY_S if first or not missing else min(self._pause_s * 1.5, RARE_S)
        self._pause_s = min(self._pause_s, CHECK_EVERY_S * 2) if needed else self._pause_s
        self._since_s, self._next_s = now_s, now_s + self._pause_s
        return requests

    def _is_short(self, name: str, seconds: float) -> bool:
        tries = self._tries[name]
        if name not in _NEEDED and tries >= TRIES_OF_A_MESSAGE:
            return False
        return self._counts[name] < int(self._wanted[name] * seconds * ENOUGH)

    def _is_unseen(self, name: str) -> bool:
        return name not in self._seen_once and self._tries[name] < TRIES_OF_A_MESSAGE

    def _on_ack(self, result: int, now_s: float) -> None:
        if result == mavlink.MAV_RESULT_UNSUPPORTED and self._refused_since_s is None:
            self._refused_since_s = now_s

    def _interval(self, name: str) -> Message:
        interval_us = 1e6 / self._wanted[name]
        return self._command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, _IDS[name], interval_us)

    def _request(self, name: str) -> Message:
        return self._command(mavlink.MAV_CMD_REQUEST_MESSAGE, _IDS[name], 0)

    def _command(self, command: int, p1: float, p2: float) -> Message:
        return mavlink.MAVLink_command_long_message(*self._target, command, 0, p1, p2, 0, 0, 0, 0, 0)

    def _old_stream(self, stream: int, hz: int) -> Message:
        return mavlink.MAVLink_request_data_stream_message(*self._target, stream, hz, 1)
