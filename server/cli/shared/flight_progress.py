"""What ``fly`` shows while the vehicle flies: one line that replaces itself, and a line per event."""

from __future__ import annotations

import time

from planning.following.live import Following, Progress, follow_on
from planning.following.reference import Reference, reference_line
from server.cli.shared.output import end_progress, progress, say
from server.heard.vehicle_place import Placer
from telemetry.flight.preflight.prepare import FlyOptions, Prepared
from telemetry.topics.messages import FlightStatus
from telemetry.topics.vehicle import VehicleState

FLYING = ("arming", "taking_off", "flying", "paused", "returning")


class FlightProgress:
    """Knows whether the vehicle is in the air, and where it is against the plan."""

    def __init__(self, options: FlyOptions) -> None:
        self.in_flight = self.has_flown = False
        self._options = options
        self._placer = Placer(options.dsm) if options.dsm is not None else None
        self._reference: Reference | None = None
        self._following = Following()

    def tell(self, text: str) -> None:
        end_progress()
        say(text)

    def on_start(self, prepared: Prepared) -> None:
        self.in_flight = self.has_flown = True
        if self._options.dsm is not None:
            self._reference = reference_line(prepared.mission, self._options.dsm, self._options.profile)

    def on_refused(self) -> None:
        self.in_flight = self.has_flown = False

    def on_state(self, state: VehicleState, flight: FlightStatus) -> None:
        self.in_flight = flight.phase in FLYING or state.armed
        parts = [flight.phase.replace("_", " ")]
        if flight.target is not None:
            parts.append(f"item {flight.target} of {flight.targets}")
        if state.alt_rel_home_m is not None:
            parts.append(f"{state.alt_rel_home_m:.1f} m above home")
        if state.ground_speed_m_s is not None:
            parts.append(f"{state.ground_speed_m_s:.1f} m/s")
        parts += self._against_plan(state) if flight.phase == "flying" else []
        if state.battery_share is not None:
            parts.append(f"battery {100 * state.battery_share:.0f} %")
        progress(", ".join(parts), None)

    def _against_plan(self, state: VehicleState) -> list[str]:
        place = self._placer.place(state) if self._placer else None
        if place is None or self._reference is None:
            return []
        x, y, z = (float(v) for v in place)
        self._following, made = follow_on(self._following, self._reference, (x, y, z), time.monotonic())
        at = self._following.at
        assert at is not None
        beside = f"{abs(at.cross_track_m):.2f} m {'right' if at.cross_track_m >= 0 else 'left'}"
        return [f"{beside}, {at.height_error_m:+.2f} m high", *_time_left(made)]


def _time_left(made: Progress) -> list[str]:
    return [] if made.time_left_s is None else [f"{max(0.0, made.time_left_s):.0f} s left"]
