"""Commands and their results (MAV_CMD, MAV_RESULT) in words for the operator."""

from __future__ import annotations

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS, CANCELLED = range(7)
ARM_DISARM, TAKEOFF, SET_MODE, MISSION_START = 400, 22, 176, 300

_COMMANDS = {
    16: "fly to a waypoint",
    20: "return home",
    21: "land",
    TAKEOFF: "take off",
    115: "turn to a heading",
    SET_MODE: "change the flight mode",
    178: "change the speed",
    192: "fly to a place",
    193: "pause or go on",
    195: "look at a place",
    224: "go to a mission item",
    MISSION_START: "start the mission",
    401: "check whether it may arm",
    511: "send a message regularly",
    512: "send a message",
}
_RESULTS = {
    TEMPORARILY_REJECTED: "it cannot do that now",
    DENIED: "it denied that",
    UNSUPPORTED: "it does not know that command",
    FAILED: "it tried and failed",
    CANCELLED: "that was cancelled",
    7: "it takes that command only as COMMAND_LONG",
    8: "it takes that command only as COMMAND_INT",
    9: "it does not know that altitude frame",
}


def command_words(command: int, param1: float = 0.0) -> str:
    """What is asked of the vehicle, as it stands after "to": "arm", "change the flight mode"."""
    if command == ARM_DISARM:
        return "arm" if param1 == 1 else "disarm"
    return _COMMANDS.get(command, f"do command {command}")


def result_words(result: int) -> str:
    return _RESULTS.get(result, f"it answered with result {result}")
