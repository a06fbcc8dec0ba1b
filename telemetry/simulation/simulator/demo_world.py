"""The demo's world: what has changed around the demo's mission since its surface model was made.

A new building stands on the mission's first leg, trees beside a later one, and a crane farther off. Another drone
flies to and fro straight ahead of the second leg, beyond the point where the mission turns off: it comes up to the
vehicle head-on and turns back before it. Home, its column and every way home at the demo's RTL height are free.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

from planning.ground.demo_hillside import demo_pois
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene.world_file import FORMAT, VERSION

NAME = "Demo hillside, some years later"
_BUILDING_ALONG_M = 33.0
"""From home, on the way to the second point."""
_DRONE_BEYOND_M = (18.0, 52.0)
"""The gully, where the mission turns off: never in the region that is searched ahead, 10 m deep."""
_DRONE_M_S = 6.0
"""So that it comes up and turns back at least once while the vehicle flies towards it, whenever the flight began."""


def write_demo_world(path: Path) -> None:
    """The same bytes every time."""
    path.write_text(json.dumps(demo_world(), indent=2) + "\n", encoding="utf-8")


def demo_world() -> dict[str, object]:
    """As a world file's JSON document; its origin is the demo's first point, where the vehicle is switched on."""
    home = demo_pois()[0]
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": NAME,
        "origin": {"lat_deg": home.lat_deg, "lon_deg": home.lon_deg},
        "objects": [_building(), *_trees(), *_crane(), _drone()],
    }


def _building() -> dict[str, object]:
    """Five metres higher than the mission flies there, square across its way."""
    east, north = _towards(1)
    along = _BUILDING_ALONG_M / math.hypot(east, north)
    return {
        "type": "box",
        "name": "New building",
        "at_m": [round(east * along, 3), round(north * along, 3)],
        "size_m": [14.0, 8.0, 10.3],
        "heading_deg": round(math.degrees(math.atan2(east, north)), 3),
        "material": "concrete",
    }


def _trees() -> list[dict[str, object]]:
    """On both sides of the way from the ruin to the gully, too far from it to be in the way."""
    (e1, n1), (e2, n2) = _towards(1), _towards(2)
    length = math.dist((e1, n1), (e2, n2))
    u, v = (e2 - e1) / length, (n2 - n1) / length
    places = ((35.0, -7.5, 7.0), (41.0, 8.0, 8.0), (47.0, -8.0, 6.5))
    return [
        {
            "type": "tree",
            "name": f"Young tree {number}",
            "at_m": [round(e1 + along * u + aside * v, 3), round(n1 + along * v - aside * u, 3)],
            "height_m": height,
            "crown_radius_m": 1.8,
        }
        for number, (along, aside, height) in enumerate(places, 1)
    ]


def _crane() -> list[dict[str, object]]:
    """East of the lava levee; its jib points away from the mission."""
    east, north = _towards(3)
    at = [round(east + 45.0, 3), round(north - 40.0, 3)]
    return [
        {"type": "box", "name": "Crane", "at_m": at, "size_m": [1.8, 1.8, 38.0], "material": "metal"},
        {
            "type": "box",
            "name": "Crane jib",
            "at_m": [round(at[0] + 14.0, 3), at[1]],
            "base_m": 34.0,
            "size_m": [44.0, 1.4, 1.4],
            "material": "metal",
        },
    ]


def _drone() -> dict[str, object]:
    """On the line from the ruin to the gully."""
    (e1, n1), (e2, n2) = _towards(1), _towards(2)
    length = math.dist((e1, n1), (e2, n2))
    u, v = (e2 - e1) / length, (n2 - n1) / length
    ends = [[round(e2 + beyond * u, 3), round(n2 + beyond * v, 3)] for beyond in reversed(_DRONE_BEYOND_M)]
    return {
        "type": "box",
        "name": "Other drone",
        "path": {"points_m": ends, "speed_m_s": _DRONE_M_S},
        "base_m": 5.0,
        "size_m": [0.9, 0.9, 0.4],
        "material": "metal",
    }


def _towards(poi: int) -> tuple[float, float]:
    """East and north of one of the demo's points from its first."""
    home, other = demo_pois()[0], demo_pois()[poi]
    north, east, _ = NeuFrame(home.lat_deg, home.lon_deg, 0.0).neu_from_geodetic(other.lat_deg, other.lon_deg, 0.0)
    return east, north
