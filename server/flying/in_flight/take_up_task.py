"""What the workers do with a plan that is taken up in flight: the way into it and its rest, judged before it is sent
and once more as it was read back."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from planning.basics.plan_model import Firmware, Mission
from planning.certificate.as_json import certificate_json
from planning.formats.wpl import read_wpl, write_wpl
from planning.missions.joined_mission import as_planned, common_places
from planning.missions.vehicle_profile import dump_profile
from planning.planner.request import effective_profile
from server.flying.in_flight.way_task import with_seen
from server.library.documents import demands_from_doc, places_of
from server.library.fences import fence_from_doc
from server.library.terrains import load_terrain
from server.plan.tasks import last_plan
from server.scene.mirror import Voxels
from server.schemas import CheckRow, PlanDoc, TakenUpDoc
from server.work.jobs import Progress
from telemetry.errors import NotAllowedError
from telemetry.flight.home_watch import HomePlace
from telemetry.topics.messages import PlanRecord
from telemetry.topics.onboard_lists import Item, OnboardMission, PlaceList, PlacesOnboard
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from telemetry.flight.certified_way import Flown
    from telemetry.flight.taking_up import FlownOver, TakenUp


@dataclass(frozen=True, slots=True)
class AskedTakeUp:
    """All that it is judged by, of one moment."""

    directory: Path
    """Of the surface model."""
    document: PlanDoc
    terrain_name: str
    before: PlanRecord | None
    """What was uploaded last."""
    next_item: int
    """Of the mission on board, if it is that one, the item that is flown to; 1: nothing of it is flown."""
    state: VehicleState
    now_mono_s: float
    parameters: dict[str, float | None]
    aboard: PlacesOnboard
    before_tries: PlacesOnboard
    """What was on board before any try of this flight sent a list: what a plan without one goes back to."""
    maps: tuple[Voxels, ...]
    took_off: HomePlace | None
    """The home that the flight began with."""


@dataclass(frozen=True, slots=True)
class MadeTakeUp:
    items: tuple[Item, ...]
    record: PlanRecord
    """Its digest is still empty: the vehicle's read-back gives it."""
    places: dict[PlaceList, tuple[Item, ...]]
    """Fence and rally points that are sent before the mission; an empty list clears what is on board."""
    doc: TakenUpDoc
    begins: tuple[float, float, float]
    """lat_deg, lon_deg, alt_rel_home_m"""


def make_take_up(asked: AskedTakeUp, *, report: Progress) -> MadeTakeUp:
    """Of the plan that was computed last. Raises NotAllowedError, PlanningError."""
    from telemetry.flight.taking_up import taken_up
    from telemetry.mavlink.items import items_from_mission

    plan, source, _ = last_plan.of(asked.directory, asked.document, report)
    report("Finding the way into the plan", None)
    planned = read_wpl(write_wpl(plan.mission))
    flown_items = 0 if asked.before is None else _flown_items(asked.before, planned, asked.next_item)
    sent = _sent(asked, planned.firmware)
    places = {"fence": asked.aboard.fence, "rally": asked.aboard.rally} | sent
    over = _over(asked)
    flown = _flown(asked, over, PlacesOnboard(places["fence"], places["rally"], asked.aboard.unread))
    found = taken_up(over, planned, asked.state, flown, flown_items=flown_items, now_s=asked.now_mono_s)
    text, passed = write_wpl(found.mission), replace(planned, items=planned.items[: found.joined.item])
    record = PlanRecord(
        t_utc_s=time.time(),
        name=asked.document.name,
        mission_wpl=text,
        digest="",
        firmware=planned.firmware,
        terrain_id=asked.document.terrain_id or "",
        terrain_name=asked.terrain_name,
        terrain_sha256=source.sha256,
        home_alt_dsm_m=found.mission.home.alt_dsm_m,
        vertical_datum=source.vertical_datum,
        profile_toml=dump_profile(effective_profile(plan.request.profile, plan.request.path)),
        certificate_json="",
        plan_json=asked.document.model_dump_json(),
        taken_up=True,
        way_items=len(found.mission.items) - len(planned.items) + found.joined.item,
        passed_wpl=write_wpl(passed) if passed.items else "",
        passed_flown=flown_items,
    )
    doc = _doc(found, _list_notes(asked, sent, planned.firmware))
    return MadeTakeUp(items_from_mission(read_wpl(text)), record, sent, doc, found.begins)


def check_take_up(asked: AskedTakeUp, onboard: OnboardMission, *, report: Progress) -> str:
    """Of what was read back, with the fence and rally points that are on board by now: its certificate as JSON.

    Raises NotAllowedError, PlanningError.
    """
    from telemetry.flight.preflight.fence_check import fence_row
    from telemetry.flight.taking_up import certified_on_board

    report("Certifying what is on board", None)
    firmware = demands_from_doc(asked.document).profile.firmware
    row = fence_row(fence_from_doc(asked.document), asked.aboard, asked.parameters, firmware)
    if row is not None and row.state in ("bad", "unknown"):
        raise NotAllowedError(row.text, where="fence", advice=row.mend)
    over = _over(asked)
    found = certified_on_board(over, onboard, firmware, asked.state, _flown(asked, over, asked.aboard))
    return json.dumps(certificate_json(found), allow_nan=False)


def _flown_items(before: PlanRecord, planned: Mission, next_item: int) -> int:
    """Of the plan that is to be taken up: what both begin with alike, and was flown, whatever way led into the one
    that is flown."""
    flown = read_wpl(before.mission_wpl)
    if before.taken_up:
        passed = read_wpl(before.passed_wpl).items if before.passed_wpl else ()
        flown, next_item = as_planned(
            flown, passed, way_items=before.way_items, flown_items=before.passed_flown, next_item=next_item
        )
    return common_places(flown, planned, next_item=next_item)


def _sent(asked: AskedTakeUp, firmware: Firmware) -> dict[PlaceList, tuple[Item, ...]]:
    """Fence and rally points of the plan; where it has none, those that were on board before any try, without those of
    the plan before. What is on board already is not sent again."""
    from telemetry.flight.preflight.fence_check import NOTHING, sent_places
    from telemetry.mavlink.verify import compare

    before = sent_places(NOTHING if asked.before is None else places_of(asked.before), firmware)
    sent: dict[PlaceList, tuple[Item, ...]] = {}
    for kind, items in sent_places(fence_from_doc(asked.document), firmware).items():
        aboard, kept = _list(asked.aboard, kind), _list(asked.before_tries, kind)
        if not items and compare(before[kind], kept, firmware=firmware)[1]:
            items = kept
        if items != aboard:
            sent[kind] = items
    return sent


def _list(places: PlacesOnboard, kind: PlaceList) -> tuple[Item, ...]:
    return places.fence if kind == "fence" else places.rally


def _list_notes(asked: AskedTakeUp, sent: dict[PlaceList, tuple[Item, ...]], firmware: Firmware) -> list[str]:
    """What becomes of a list on board that the plan does not have."""
    from telemetry.flight.preflight.fence_check import sent_places

    notes = []
    for kind, items in sent_places(fence_from_doc(asked.document), firmware).items():
        name = "fence" if kind == "fence" else "rally points"
        if items or not (_list(asked.aboard, kind) or sent.get(kind)):
            continue
        if not sent.get(kind, _list(asked.aboard, kind)):
            notes.append(f"The plan has no {name}: what was on board is cleared.")
        elif kind in sent:
            notes.append(f"The plan has no {name}: what was on board before the tries is sent again, and counts.")
        else:
            notes.append(f"The plan has no {name}: what is on board stays, and counts.")
    return notes


def _flown(asked: AskedTakeUp, over: FlownOver, aboard: PlacesOnboard) -> Flown:
    from telemetry.flight.certified_way import Flown
    from telemetry.flight.home_height import home_off_m
    from telemetry.flight.preflight.fence_check import flown_within

    if aboard.unread:
        what = f"What fence the vehicle holds could not be read: {aboard.unread}"
        raise NotAllowedError(what, where="fence", advice="Look at the link, then press it again.")
    demands = demands_from_doc(asked.document)
    fence, rally = flown_within(fence_from_doc(asked.document), aboard)
    off_m = home_off_m(over.ground, asked.took_off, asked.state)
    return Flown(demands.profile, demands.clearance(), asked.parameters, fence, rally, off_m)


def _over(asked: AskedTakeUp) -> FlownOver:
    from telemetry.flight.taking_up import FlownOver

    ground, seen_id = load_terrain(asked.directory), asked.document.seen_id
    seen = with_seen(ground, asked.directory, seen_id, asked.maps, asked.state, asked.took_off)
    return FlownOver(ground, seen)


def _doc(found: TakenUp, list_notes: list[str]) -> TakenUpDoc:
    from telemetry.flight.certified_way import way_notes

    battery = found.battery
    return TakenUpDoc(
        item=found.joined.item + 1,
        way_m=found.way.length_m,
        seconds=found.way.seconds,
        left_out=found.joined.left_out,
        clearance_m=found.certificate.kept_m,
        required_m=found.certificate.required_clearance_m,
        notes=[*way_notes(found.way), *list_notes],
        battery=CheckRow(code="battery", state=battery.state, text=battery.text, mend=_LAND_SOON),
    )


_LAND_SOON = "Return home or land: it can be accepted where it suffices for the flight but not for the reserve."
