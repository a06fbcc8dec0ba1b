"""Numbers that the writer and the reader of QGroundControl plans share."""

from planning.mav_cmd import MavFrame

FIRMWARE_TYPE = {"ardupilot": 3, "px4": 12}
"""MAV_AUTOPILOT"""
QUADROTOR = 2
"""MAV_TYPE"""
ALTITUDE_MODE: dict[int, int] = {MavFrame.GLOBAL_RELATIVE_ALT: 1, MavFrame.GLOBAL: 2, MavFrame.GLOBAL_TERRAIN_ALT: 4}
"""MAV_FRAME -> QGroundControl's altitude mode: relative, absolute, terrain frame."""
COMPUTED_ABOVE_TERRAIN = 3
"""QGroundControl's altitude mode whose heights it turned into AMSL itself."""
DEFAULT_SPEED_M_S = 5.0
