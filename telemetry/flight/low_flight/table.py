"""What each action of a failsafe means close to the ground, and the numbers that have to suit the plan.

Values are ArduCopter's (4.3 to 4.7) and PX4's (1.14 to 1.17), as their own parameter references give them.
"""

from __future__ import annotations

from dataclasses import dataclass

from planning.basics.plan_model import Firmware
from telemetry.flight.low_flight.findings import State

LAND = "lands where it is: into whatever is below on this route"
RETURN = "flies home at its return height"
NOTHING = "does nothing: the flight goes on"
SMART = "goes back along its own track, which is as low as the plan"
CENTI = 0.01


@dataclass(frozen=True, slots=True)
class Action:
    """One parameter that chooses what the vehicle does."""

    name: str
    when: str
    meanings: dict[int, tuple[State, str]]
    better: int
    goes_on: tuple[str, int] | None = None
    """A bit mask, and its bit that makes a mission go on all the same."""


_PX4_ON_LOSS: dict[int, tuple[State, str]] = {
    1: ("look", "holds its place until the battery is low"),
    2: ("good", RETURN),
    3: ("bad", LAND),
    5: ("bad", "ends the flight: it falls"),
    6: ("bad", "stops its motors in the air"),
}
"""Of NAV_DLL_ACT and NAV_RCL_ACT."""

ACTIONS: dict[Firmware, tuple[Action, ...]] = {
    "ardupilot": (
        Action(
            "FS_GCS_ENABLE",
            "When this station is not heard any more, the vehicle",
            {
                0: ("bad", f"{NOTHING} without anybody who sees it"),
                1: ("good", RETURN),
                3: ("look", f"{SMART}, or {RETURN}"),
                4: ("bad", f"{SMART}, or {LAND}"),
                5: ("bad", LAND),
                6: ("look", f"flies to the mission's landing, or {RETURN}"),
                7: ("bad", f"stops, or {LAND}"),
            },
            1,
            ("FS_OPTIONS", 1),
        ),
        Action(
            "FS_THR_ENABLE",
            "When the transmitter is not heard any more, the vehicle",
            {
                0: ("look", NOTHING),
                1: ("good", RETURN),
                3: ("bad", LAND),
                4: ("look", f"{SMART}, or {RETURN}"),
                5: ("bad", f"{SMART}, or {LAND}"),
                6: ("look", f"flies to the mission's landing, or {RETURN}"),
                7: ("bad", f"stops, or {LAND}"),
            },
            1,
            ("FS_OPTIONS", 0),
        ),
        Action(
            "BATT_FS_LOW_ACT",
            "When the battery is low, the vehicle",
            {
                0: ("bad", f"{NOTHING} until it is empty"),
                1: ("bad", LAND),
                2: ("good", RETURN),
                3: ("look", f"{SMART}, or {RETURN}"),
                4: ("bad", f"{SMART}, or {LAND}"),
                5: ("bad", "stops its motors in the air"),
                6: ("look", f"flies to the mission's landing, or {RETURN}"),
            },
            2,
        ),
        Action(
            "BATT_FS_CRT_ACT",
            "When the battery is nearly empty, the vehicle",
            {
                0: ("look", NOTHING),
                1: ("good", "lands where it is, before it falls"),
                2: ("look", f"{RETURN}, if the battery lasts"),
                3: ("look", f"{SMART}, or {RETURN}, if the battery lasts"),
                4: ("look", f"{SMART}, or lands where it is"),
                5: ("bad", "stops its motors in the air"),
                6: ("look", f"flies to the mission's landing, or {RETURN}, if the battery lasts"),
            },
            1,
        ),
        Action(
            "FS_EKF_ACTION",
            "When the vehicle does not know its position any more, it",
            {
                0: ("bad", "only says so, and flies on by a wrong position"),
                1: ("look", f"{LAND}, drifting with the wind. Have the transmitter at hand"),
                2: ("look", "keeps its height, drifts with the wind and waits for the transmitter"),
                3: ("look", f"{LAND}, drifting with the wind, in manual modes as well. Have the transmitter at hand"),
            },
            1,
        ),
        Action(
            "RTL_ALT_TYPE",
            "Its return height",
            {
                0: ("good", "counts from home, as certificates take it"),
                1: ("bad", "counts from the vehicle's own terrain data, which no certificate covers"),
            },
            0,
        ),
        Action(
            "OA_TYPE",
            "On its way to a place, the vehicle",
            {
                0: ("good", "keeps to the planned line"),
                1: ("look", "goes around what its sensors see, off the certified line"),
                2: ("look", "goes around fences by ways of its own, off the certified line"),
                3: ("look", "goes around obstacles and fences by ways of its own, off the certified line"),
            },
            0,
        ),
    ),
    "px4": (
        Action(
            "NAV_DLL_ACT",
            "When this station is not heard any more, the vehicle",
            {
                0: ("bad", f"{NOTHING} without anybody who sees it"),
                **_PX4_ON_LOSS,
            },
            2,
            ("COM_DLL_EXCEPT", 0),
        ),
        Action(
            "NAV_RCL_ACT",
            "When the transmitter is not heard any more, the vehicle",
            {
                0: ("look", NOTHING),
                **_PX4_ON_LOSS,
            },
            2,
            ("COM_RCL_EXCEPT", 0),
        ),
        Action(
            "COM_LOW_BAT_ACT",
            "When the battery is low, the vehicle",
            {
                0: ("bad", "only says so, and flies until it is empty"),
                1: ("look", RETURN),
                2: ("bad", LAND),
                3: ("good", f"{RETURN}, and lands where it is before it falls"),
            },
            3,
        ),
        Action(
            "COM_POS_LOW_ACT",
            "When the position gets worse than COM_POS_LOW_EPH, the vehicle",
            {
                0: ("look", NOTHING),
                1: ("look", "only says so"),
                2: ("look", "holds its place, as far as it knows it"),
                3: ("good", RETURN),
                4: ("bad", "ends the flight: it falls"),
                5: ("bad", LAND),
            },
            3,
        ),
        Action(
            "RTL_TYPE",
            "On its return, the vehicle",
            {
                0: ("good", "flies straight home or to a rally point. The certificate is of the way home"),
                1: ("look", "flies straight to the mission's landing or a rally point: no certificate covers that"),
                2: ("look", "flies along the mission, as low as the plan"),
                3: ("look", "flies straight to whatever is nearest: the certificate is of the way home only"),
                4: ("look", "flies along the mission, as low as the plan"),
                5: ("look", "flies straight to a rally point: the certificate is of the way home only"),
            },
            0,
        ),
        Action(
            "GF_ACTION",
            "At its fence, the vehicle",
            {
                0: ("look", NOTHING),
                1: ("look", "only says so"),
                2: ("good", "holds its place"),
                3: ("good", RETURN),
                4: ("bad", "ends the flight: it falls"),
                5: ("bad", LAND),
            },
            2,
        ),
        Action(
            "COM_OBS_AVOID",
            "On its way to a place, the vehicle",
            {
                0: ("good", "keeps to the planned line"),
                1: ("look", "lets a companion computer lead it, off the certified line"),
            },
            0,
        ),
    ),
}
MAY_BE_MISSING = frozenset({"OA_TYPE", "COM_OBS_AVOID", "RTL_ALT_TYPE", "COM_POS_LOW_ACT"})
"""Some versions and boards do not have the feature at all."""
WAYPOINT_RADIUS_M = 2.0
"""With up to this, corners were measured; following errors count on it."""
WAYPOINT_HEIGHT_M = 0.8
EKF_THRESHOLD = 0.8
ROOM_M = 5.0
"""Above the highest place of the plan, for a fence."""
