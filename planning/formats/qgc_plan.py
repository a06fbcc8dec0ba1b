"""QGroundControl's `.plan` JSON: the writer; `qgc_plan_reader` reads."""

from __future__ import annotations

import json
import math

from mapping.version import __version__
from planning.basics.mav_cmd import MavFrame
from planning.basics.plan_model import Mission, MissionItem, Poi, finite_or_none
from planning.formats.commands import POSITIONED, home_altitude_note, millimetres_up, plain_frame
from planning.formats.fence_plan import fence_json, heights_json, rally_json
from planning.formats.planned_for import planned_for_json
from planning.formats.qgc_plan_reader import ALTITUDE_MODE, DEFAULT_SPEED_M_S, FIRMWARE_TYPE, QUADROTOR, read_plan
from planning.formats.safe_text import clean_name

__all__ = ["read_plan", "write_plan"]


def write_plan(mission: Mission) -> str:
    """A mission as `.plan` text; null stands for NaN; an object `hedgehop` holds home's datum and the POIs.

    QGroundControl calls the planned home altitude AMSL; ours is the surface model's height, and the
    `hedgehop` object says in which datum.
    """
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "Hedgehop",
        "mission": _mission(mission),
        "geoFence": fence_json(mission.fence),
        "rallyPoints": rally_json(mission.rally),
        "hedgehop": _provenance(mission),
    }
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def _mission(mission: Mission) -> dict[str, object]:
    home, speed = mission.home, mission.cruise_speed_m_s
    speed = DEFAULT_SPEED_M_S if speed is None else speed
    return {
        "version": 2,
        "firmwareType": FIRMWARE_TYPE[mission.firmware],
        "vehicleType": QUADROTOR,
        "cruiseSpeed": speed,
        "hoverSpeed": speed,
        "globalPlanAltitudeMode": 1,
        "plannedHomePosition": [_degrees(home.lat_deg), _degrees(home.lon_deg), finite_or_none(home.alt_dsm_m)],
        "items": [_simple_item(item, jump_id) for jump_id, item in enumerate(mission.items, start=1)],
    }


def _simple_item(item: MissionItem, jump_id: int) -> dict[str, object]:
    frame, alt_m = plain_frame(item.frame), millimetres_up(item.alt_m)
    params = [finite_or_none(p) for p in item.params] + [_degrees(item.lat_deg), _degrees(item.lon_deg), alt_m]
    plain: dict[str, object] = {
        "type": "SimpleItem",
        "command": item.command,
        "frame": frame,
        "params": params,
        "autoContinue": item.autocontinue,
        "doJumpId": jump_id,
    }
    if item.command not in POSITIONED or frame == MavFrame.MISSION:
        return plain
    return plain | {"Altitude": alt_m, "AltitudeMode": ALTITUDE_MODE.get(frame, 0), "AMSLAltAboveTerrain": None}


def _degrees(value_deg: float) -> float | None:
    return round(value_deg, 9) if math.isfinite(value_deg) else None


def _provenance(mission: Mission) -> dict[str, object]:
    home = mission.home
    return {
        "version": __version__,
        "home_alt_dsm_m": finite_or_none(home.alt_dsm_m),
        "vertical_datum": home.vertical_datum,
        "note": home_altitude_note(home),
        "cruise_speed_m_s": mission.cruise_speed_m_s,
        "pois": [_poi(poi) for poi in mission.pois],
        "surface_model": mission.surface_sha256 or None,
        "surface_name": clean_name(mission.surface_name) or None,
        "planned_for": None if mission.planned_for is None else planned_for_json(mission.planned_for),
        **heights_json(mission.fence),
    }


def _poi(poi: Poi) -> dict[str, object]:
    return {
        "lat_deg": _degrees(poi.lat_deg),
        "lon_deg": _degrees(poi.lon_deg),
        "name": clean_name(poi.name),
        "loiter_s": poi.loiter_s,
    }
