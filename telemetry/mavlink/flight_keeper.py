"""What Hedgehop is doing with the vehicle, and where a flight broke off, followed from the vehicle's state."""

from __future__ import annotations

from dataclasses import replace

from planning.basics.mav_cmd import MavCmd
from telemetry.mavlink.autopilot_orders import LAND_MODES, MISSION_MODES, RETURN_MODES
from telemetry.topics.messages import FlightPhase, FlightStatus
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.vehicle import VehicleState

GOING_HOME_COMMANDS = frozenset({MavCmd.NAV_RETURN_TO_LAUNCH, MavCmd.NAV_LAND, MavCmd.DO_LAND_START})
"""MAV_CMD of RTL, LAND and DO_LAND_START."""
UNDER_WAY = frozenset({"arming", "taking_off", "flying", "paused", "returning"})
GOING_HOME_FROM = frozenset({"taking_off", "flying", "paused", "returning", "interrupted"})


class FlightKeeper:
    """``status`` changes only by the calls below. Items are counted from 1 here, home left out."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Another vehicle."""
        self.status = FlightStatus()
        self._completed = self._was_armed = False

    @property
    def is_under_way(self) -> bool:
        return self.status.phase in UNDER_WAY

    def take_up(self, status: FlightStatus) -> None:
        """Of a link node that died. A script died with it; a mission on board goes on without us."""
        if status.phase not in UNDER_WAY:
            return
        if status.way == "guided":
            hint = "The navigation script ended with the link node. The vehicle holds its position: return home."
            status = replace(status, phase="interrupted", broke_off_at=status.target, hint=hint)
        self.status, self._was_armed = status, True

    def begin(self, targets: int, t_utc_s: float, *, first: int = 1) -> None:
        """The mission on board has been started; the vehicle is not armed yet."""
        self._completed = self._was_armed = False
        self.status = FlightStatus(way="auto", phase="arming", target=first, targets=targets, since_utc_s=t_utc_s)

    def replaced(self, targets: int, t_utc_s: float) -> None:
        """Another mission is on board, to be flown from its beginning; the vehicle holds."""
        self._completed, self._was_armed = False, True
        since_utc_s = self.status.since_utc_s or t_utc_s
        self.status = FlightStatus(way="auto", phase="paused", target=1, targets=targets, since_utc_s=since_utc_s)

    def begin_anew(self) -> None:
        """Another mission is on board: it is not gone on with where the last flight broke off."""
        if not self.is_under_way:
            self.status = replace(self.status, broke_off_at=None)

    def cancel(self, hint: str) -> None:
        """The start was refused; the vehicle is where it was."""
        self.status = FlightStatus(hint=hint)

    def broke_off_start(self, hint: str) -> None:
        """The start was interrupted by another command when the vehicle had left the ground already."""
        self.status, self._was_armed = replace(self.status, phase="taking_off", hint=hint), True

    def say(self, hint: str) -> None:
        if hint != self.status.hint:
            self.status = replace(self.status, hint=hint)

    def script(self, status: FlightStatus, *, armed: bool) -> None:
        """The guided script tells itself what it does."""
        self.status, self._was_armed = status, armed
        self._completed = status.phase in ("returning", "landed") and status.broke_off_at is None

    def on_state(self, state: VehicleState, onboard: OnboardMission | None, *, joining: bool) -> None:
        """``joining``: on the way to the item at which a broken-off mission goes on."""
        if not state.armed:
            self._on_disarmed()
            return
        self._was_armed = True
        in_mission = state.mode == MISSION_MODES.get(state.autopilot, "AUTO")
        if in_mission and (not self.is_under_way or self.status.way != "auto"):
            self.begin(_count(state, onboard), state.t_utc_s)  # started by the pilot's remote control
        if in_mission:
            self._on_mission(state, onboard)
        elif self.status.phase in GOING_HOME_FROM and (state.mode in RETURN_MODES or state.mode in LAND_MODES):
            self._go_home(state, onboard)
        elif joining:
            self._phase("flying" if state.landed == "in_air" else "taking_off")
        elif self.status.phase in ("taking_off", "flying", "returning"):
            self._phase("paused")

    def _on_mission(self, state: VehicleState, onboard: OnboardMission | None) -> None:
        target = item_of(state)
        if self._completed and (target is None or state.landed == "on_ground"):
            return  # on the ground it goes back to its first item before it says that it is disarmed
        command = _command(onboard, target)
        targets = _count(state, onboard) or self.status.targets
        status = replace(self.status, target=target or self.status.target, targets=targets, broke_off_at=None)
        if status != self.status:
            self.status = status
        self._completed = command in GOING_HOME_COMMANDS or _is_at_end(state, targets)
        if self._completed:
            self._phase("returning")
        else:
            starting = self.status.phase in ("arming", "taking_off")
            climbing = starting and (command == MavCmd.NAV_TAKEOFF or not target or state.landed == "on_ground")
            self._phase("taking_off" if climbing else "flying")

    def _go_home(self, state: VehicleState, onboard: OnboardMission | None) -> None:
        if self.status.phase == "returning":
            return
        # PX4 may tell of its mission's end and of its way home in one breath.
        self._completed |= self.status.way == "auto" and _is_at_end(state, _count(state, onboard))
        broke_off_at = None if self._completed else self.status.broke_off_at or self.status.target
        hint = "" if self.status.phase == "flying" else self.status.hint  # of what it did, until now
        self.status = replace(self.status, phase="returning", broke_off_at=broke_off_at, hint=hint)

    def _on_disarmed(self) -> None:
        if not self._was_armed or self.status.phase not in GOING_HOME_FROM:
            return
        self._was_armed = False
        broke_off_at = self.status.broke_off_at or self.status.target
        if self._completed:
            self.status = replace(self.status, phase="landed", broke_off_at=None, hint="")
        else:
            self.status = replace(self.status, phase="interrupted", broke_off_at=broke_off_at)

    def _phase(self, phase: FlightPhase) -> None:
        if self.status.phase != phase:
            self.status = replace(self.status, phase=phase)


def _is_at_end(state: VehicleState, targets: int | None) -> bool:
    """The last item's number alone may be left over from the flight before."""
    return bool(targets) and item_of(state) == targets and state.mission_reached == state.mission_item


def item_of(state: VehicleState) -> int | None:
    """Number of the mission's item that is flown to: ArduPilot counts home as 0, which is none; PX4 begins with 0."""
    if state.mission_item is None:
        return None
    return (state.mission_item or None) if state.autopilot == "ardupilot" else state.mission_item + 1


def sequence_of(item: int, autopilot: str) -> int:
    """The other way round."""
    return item if autopilot == "ardupilot" else item - 1


def _count(state: VehicleState, onboard: OnboardMission | None) -> int:
    return len(onboard.items) if onboard else state.mission_items or 0


def _command(onboard: OnboardMission | None, item: int | None) -> int | None:
    if onboard is None or item is None or not 1 <= item <= len(onboard.items):
        return None
    return onboard.items[item - 1].command
