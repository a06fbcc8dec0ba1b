"""The vehicle against the plan that it flies and the surface model below it, position by position."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import VehicleProfile, finite_or_none
from planning.following.below import Demanded
from planning.following.lag import planned_s
from planning.following.live import Following, follow_on
from planning.following.reference import Reference, reference_line
from planning.following.surface_distance import SurfaceDistance
from planning.formats.wpl import read_wpl
from planning.missions.vehicle_profile import parse_profile
from planning.terrain.dsm import Dsm
from server.heard.vehicle_place import Placer, home_distance_bearing
from server.library.documents import clearance_of
from server.schemas import FollowDoc
from server.work.loading import loaded_to_stay
from telemetry.topics.messages import FlightStatus, PlanRecord
from telemetry.topics.vehicle import VehicleState

NO_FLIGHT = FlightStatus()
_OFF_PLAN = ("returning", "landed", "interrupted")
OFF_LINE_M = 15.0
"""Who is farther from its line has left it: other stations are not told that it flies that."""
EARLY_LATE_S, EARLY_LATE_SHARE = 2.0, 0.1
"""Of a plan's predicted times: so much earlier or later, and that share of the time until then."""
MARGIN_M = 400.0
"""Around a plan: what lies farther away is not asked for, and a large model would take seconds and gigabytes."""

_KERNELS = threading.Lock()
"""Not every threading layer of the kernels bears two callers at once: some end the whole process."""


@dataclass(frozen=True, slots=True)
class Followed:
    """A plan over its surface model, made ready to be followed."""

    placer: Placer
    surface: SurfaceDistance
    reference: Reference
    demanded: Demanded | None = None
    """What the plan requires of the flight; None where nothing tells it."""
    profile: VehicleProfile | None = None
    begins_in_air: bool = False
    """It was taken up in flight: its way begins where the vehicle hovers, not at home."""

    @staticmethod
    def of(record: PlanRecord, dsm: Dsm) -> Followed:
        """Takes seconds on a busy machine: for a thread. Raises PlanningError."""
        mission = read_wpl(record.mission_wpl)
        profile = parse_profile(record.profile_toml.encode(), where="the plan's profile")
        over = Followed.over(reference_line(mission, dsm, profile, begins_in_air=record.taken_up), dsm)
        return replace(over, demanded=_demanded(record), profile=profile, begins_in_air=record.taken_up)

    @staticmethod
    def over(reference: Reference, dsm: Dsm) -> Followed:
        """With every kernel loaded that following it needs: the first position would load them on the event loop."""
        with _KERNELS, loaded_to_stay():
            surface = SurfaceDistance(_window(dsm, reference.points_m))
            x, y, z = map(float, reference.first_m)
            surface.distance_m((x, y, z))
            begun, _ = follow_on(Following(), reference, (x, y, z), 0.0)
            follow_on(begun, reference, (x, y, z), 1.0)
        return Followed(Placer(dsm), surface, reference)


@dataclass(frozen=True, slots=True)
class Ahead:
    """What is left of a line that is being flown, as predicted from the last position on."""

    lat_lon_deg: F64
    """(N, 2)"""
    alt_rel_home_m: F64
    """(N,)"""
    t_s: F64
    """(N,) seconds from now; never falling"""
    early_late_s: float = EARLY_LATE_S
    early_late_share: float = EARLY_LATE_SHARE
    """So much earlier or later it may be there: that, and that share of ``t_s``."""
    off_m: float = 0.0
    """So far beside the line it is."""


@dataclass(frozen=True, slots=True)
class Whole:
    """All of a plan's way: up from home, along the line, and straight home at the return height.

    One that was taken up in flight has no way up, and its times count from where it begins.
    """

    lat_lon_deg: F64
    """(N, 2)"""
    alt_rel_home_m: F64
    """(N,)"""
    t_s: F64 | None
    """(M,) predicted seconds since lift-off, of the first M of them, up to the line's end; None where unknown"""
    takeoff_s: float
    """Until it leaves the first waypoint; where between the ground and there it is before that, nothing tells."""


class Follower:
    """Remembers where along the plan the vehicle was; quick enough for the event loop."""

    def __init__(self, followed: Followed | None = None, *, over: Dsm | None = None) -> None:
        """``over``: the surface model below, when there is no plan to follow."""
        self._followed = followed
        self._over = None if over is None else Placer(over)
        self._following = Following()
        self._share: float | None = None
        self._least_m: float | None = None

    @property
    def profile(self) -> VehicleProfile | None:
        """Of the vehicle that the plan was made for; None without a plan."""
        return None if self._followed is None else self._followed.profile

    def begin_again(self) -> None:
        """The next position is the first of a flight, or lies elsewhere."""
        self._following, self._share, self._least_m = Following(), None, None

    def follow(self, state: VehicleState, flight: FlightStatus = NO_FLIGHT) -> FollowDoc | None:
        """None as long as there is no position. On the way home nothing is held against the plan any more."""
        if state.lat_deg is None:
            return None
        placer = self._over if self._followed is None else self._followed.placer
        place = None if placer is None else placer.place(state)
        distance_m, bearing_deg = home_distance_bearing(state)
        if placer is None or place is None:
            near = {}
        elif self._followed is None:
            near = {"height_above_dsm_m": finite_or_none(float(place[2] - placer.dsm.elevation_at(place[None, :2])[0]))}
        else:
            xyz_m = (float(place[0]), float(place[1]), float(place[2]))
            near = self._over_ground(self._followed, xyz_m)
            if flight.phase not in _OFF_PLAN:
                near |= self._against_plan(self._followed, xyz_m, state)
                self._keep_least(flight, near)
            elif flight.phase != "landed":
                near["progress"] = self._share
            near |= self._against_required(self._followed)
        return FollowDoc(
            **{**_UNKNOWN, "alt_rel_home_m": state.alt_rel_home_m, **near},
            home_distance_m=distance_m,
            home_bearing_deg=bearing_deg,
        )

    def ahead(self, flight: FlightStatus) -> Ahead | None:
        """None where no plan is flown, or where nothing tells its times."""
        followed, at = self._followed, self._following.at
        if followed is None or at is None or not self._following.begun or flight.phase != "flying":
            return None
        reference, first = followed.reference, at.leg + 1
        t_s = np.column_stack([reference.arrive_s, reference.leave_s])[first:].ravel()
        t_s = t_s - planned_s(reference, at.leg, at.share)
        if not len(t_s) or not np.isfinite(t_s).all():
            return None
        points_m = np.repeat(reference.points_m[first:], 2, axis=0)
        lat_lon_deg = followed.placer.dsm.lat_lon_from_xy(points_m[:, :2])
        return Ahead(
            lat_lon_deg, points_m[:, 2] - reference.home_alt_dsm_m, np.maximum.accumulate(np.maximum(t_s, 0.0))
        )

    def rising(self) -> Ahead | None:
        """All of a plan's line, while the vehicle takes off: anywhere up to its first waypoint it may be for as long as
        that takes."""
        followed = self._followed
        if followed is None or followed.begins_in_air:
            return None
        reference = followed.reference
        t_s = np.maximum.accumulate(np.column_stack([reference.arrive_s, reference.leave_s]).ravel())
        if not len(t_s) or not np.isfinite(t_s).all():
            return None
        points_m = np.repeat(reference.points_m, 2, axis=0)
        lat_lon_deg = followed.placer.dsm.lat_lon_from_xy(points_m[:, :2])
        up_m, early_s = points_m[:, 2] - reference.home_alt_dsm_m, EARLY_LATE_S + reference.takeoff_s
        return Ahead(lat_lon_deg, up_m, np.maximum(t_s, 0.0), early_late_s=early_s)

    @property
    def followed(self) -> Followed | None:
        """None without a plan; another plan, or the same one anew, is another object."""
        return self._followed

    def line_s(self, flight: FlightStatus) -> float | None:
        """Where on the plan's line it is, by the line's own times; None where the autopilot does not fly that as its
        mission, or has not come to it yet, or is beside it."""
        followed, at = self._followed, self._following.at
        if followed is None or at is None or not self._following.begun:
            return None
        if (flight.way, flight.phase) != ("auto", "flying"):
            return None
        if math.hypot(at.cross_track_m, at.height_error_m) > OFF_LINE_M:
            return None
        return finite_or_none(planned_s(followed.reference, at.leg, at.share))

    def whole(self) -> Whole | None:
        """None where no plan is known."""
        followed = self._followed
        if followed is None or followed.profile is None:
            return None
        reference, home_m = followed.reference, followed.reference.home_alt_dsm_m
        x, y = reference.home_xy_m
        line_m = np.repeat(reference.points_m, 2, axis=0)
        back_m = max(home_m + followed.profile.rtl_height_m, float(line_m[-1, 2]))
        home = np.array([[*line_m[-1, :2], back_m], [x, y, back_m], [x, y, home_m]])
        t_s, takeoff_s = np.column_stack([reference.arrive_s, reference.leave_s]).ravel(), reference.takeoff_s
        if followed.begins_in_air:
            points_m, t_s, takeoff_s = np.vstack([line_m, home]), t_s - t_s[0], 0.0
        else:
            points_m, t_s = np.vstack([[x, y, home_m], line_m, home]), np.concatenate([[0.0], t_s])
        return Whole(
            followed.placer.dsm.lat_lon_from_xy(points_m[:, :2]),
            points_m[:, 2] - home_m,
            np.maximum.accumulate(t_s) if np.isfinite(t_s).all() else None,
            takeoff_s,
        )

    def _keep_least(self, flight: FlightStatus, near: dict[str, float | None]) -> None:
        """Only on the line: rising to it and landing, the vehicle is near the ground as it must be."""
        distance_m = near["distance_to_dsm_m"]
        if flight.phase == "flying" and near["cross_track_m"] is not None and distance_m is not None:
            self._least_m = distance_m if self._least_m is None else min(self._least_m, distance_m)

    def _against_required(self, followed: Followed) -> dict[str, float | None]:
        required_m = None if followed.demanded is None else followed.demanded.required_m
        return {"required_distance_m": required_m, "least_distance_m": self._least_m}

    def _over_ground(self, followed: Followed, xyz_m: tuple[float, float, float]) -> dict[str, float | None]:
        return {
            "height_above_dsm_m": followed.surface.height_m(xyz_m),
            "distance_to_dsm_m": _distance_m(followed.surface, xyz_m),
            "alt_rel_home_m": xyz_m[2] - followed.reference.home_alt_dsm_m,
        }

    def _against_plan(
        self, followed: Followed, xyz_m: tuple[float, float, float], state: VehicleState
    ) -> dict[str, float | None]:
        self._following, progress = follow_on(self._following, followed.reference, xyz_m, state.t_utc_s)
        at, self._share = self._following.at, progress.share
        assert at is not None
        # On the ground, and while it rises to the line, nothing is an error yet.
        on_line = state.armed and self._following.begun
        return {
            "s_m": at.s_m,
            "cross_track_m": at.cross_track_m if on_line else None,
            "height_error_m": at.height_error_m if on_line else None,
            "progress": progress.share,
            "time_left_s": progress.time_left_s,
            # On the ground nobody is late.
            "behind_plan_s": progress.behind_plan_s if state.armed else None,
        }


def _demanded(record: PlanRecord) -> Demanded | None:
    if not record.plan_json:
        return None
    params = clearance_of(record)
    return Demanded(params.required_clearance_m, params.following_m)


def _distance_m(surface: SurfaceDistance, xyz_m: tuple[float, float, float]) -> float | None:
    """None while another plan is being made ready: the next position will tell."""
    if not _KERNELS.acquire(blocking=False):
        return None
    try:
        return surface.distance_m(xyz_m)
    finally:
        _KERNELS.release()


_UNKNOWN: dict[str, float | None] = dict.fromkeys(
    (
        "s_m",
        "cross_track_m",
        "height_error_m",
        "height_above_dsm_m",
        "distance_to_dsm_m",
        "progress",
        "time_left_s",
        "behind_plan_s",
    )
)


def _window(dsm: Dsm, points_m: F64) -> Dsm:
    low, high = points_m[:, :2].min(axis=0) - MARGIN_M, points_m[:, :2].max(axis=0) + MARGIN_M
    rows, columns = dsm.fractional_cell(np.array([low, high]))
    row0, row1 = math.floor(rows.min()), math.ceil(rows.max())
    col0, col1 = math.floor(columns.min()), math.ceil(columns.max())
    return dsm.window(row0, col0, row1 - max(0, row0), col1 - max(0, col0))
