"""What aircraft are called: their kinds, and names out of bytes that anybody may have sent."""

from __future__ import annotations

ADSB_KINDS = {
    1: "light",
    2: "small",
    3: "large",
    4: "large, strong wake",
    5: "heavy",
    6: "high performance",
    7: "helicopter",
    9: "glider",
    10: "balloon or airship",
    11: "parachute",
    12: "ultralight",
    14: "drone",
    15: "spacecraft",
    17: "emergency vehicle",
    18: "service vehicle",
    19: "obstacle",
}
"""By ADSB_EMITTER_TYPE."""
REMOTE_ID_KINDS = {
    1: "aeroplane drone",
    2: "multirotor drone",
    3: "gyroplane drone",
    4: "VTOL drone",
    5: "ornithopter",
    6: "glider drone",
    7: "kite",
    8: "free balloon",
    9: "captive balloon",
    10: "airship",
    11: "parachute",
    12: "rocket",
    13: "tethered drone",
    14: "obstacle",
}
"""By MAV_ODID_UA_TYPE."""
NAME_MAX = 24


def clean(sent: bytes | str) -> str:
    """Printable ASCII of what came before the first zero: nothing that moves a cursor or turns a line around."""
    text = sent.decode("ascii", "replace") if isinstance(sent, bytes) else sent
    text = text.split("\0", 1)[0]
    return "".join(c for c in text if c.isascii() and c.isprintable()).strip()[:NAME_MAX]
