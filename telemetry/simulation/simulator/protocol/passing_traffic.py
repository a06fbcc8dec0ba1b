"""A light aircraft that flies past the simulated vehicle again and again, as an ADS-B receiver on board tells of it."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.neu_frame import NeuFrame

SPEED_M_S = 55.0
FROM_M, ASIDE_M, ABOVE_M = 14_000.0, 900.0, 220.0
"""So far south it begins and so far north it turns back; so far east of home it passes, and so high above it."""
_ICAO = 0xF00001
"""Of none that flies: the block is not assigned to any state."""
_FLAGS = (
    wire.ADSB_FLAGS_VALID_COORDS
    | wire.ADSB_FLAGS_VALID_ALTITUDE
    | wire.ADSB_FLAGS_VALID_HEADING
    | wire.ADSB_FLAGS_VALID_VELOCITY
    | wire.ADSB_FLAGS_VALID_CALLSIGN
    | wire.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
    | wire.ADSB_FLAGS_SIMULATED
)


def passing(frame: NeuFrame, now_s: float) -> MAVLink_message:
    """North for one pass, south for the next; simulated time."""
    gone_m = (SPEED_M_S * now_s) % (4 * FROM_M)
    is_northbound = gone_m < 2 * FROM_M
    north_m = gone_m - FROM_M if is_northbound else 3 * FROM_M - gone_m
    lat_deg, lon_deg, alt_m = frame.geodetic_from_neu((north_m, ASIDE_M, ABOVE_M))
    return wire.MAVLink_adsb_vehicle_message(
        _ICAO,
        round(lat_deg * 1e7),
        round(lon_deg * 1e7),
        wire.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        round(1000 * alt_m),
        0 if is_northbound else 18_000,
        round(100 * SPEED_M_S),
        0,
        b"DEMO1",
        wire.ADSB_EMITTER_TYPE_LIGHT,
        0,
        _FLAGS,
        0,
    )
