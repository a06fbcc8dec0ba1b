"""What is known of the mission on board: nothing, until a read-back has shown it, and not any longer than that; and
whether the flight that is under way may go on with it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Literal

from telemetry.errors import MissionUnknownError, NotAllowedError
from telemetry.flight.avoidance.fence_aboard import PARAMETERS as FENCE_PARAMETERS
from telemetry.flight.avoidance.fence_aboard import FenceAboard
from telemetry.flight.guided.beginning import Steady, why_not_from, why_not_gone_on
from telemetry.mavlink.actions import Message
from telemetry.mavlink.autopilot_orders import MISSION_MODES
from telemetry.mavlink.parameters.values import parameter_value
from telemetry.topics.onboard_lists import OnboardMission
from telemetry.topics.requests import FlyWay, TakeUp
from telemetry.topics.vehicle import VehicleState

SETTLE_S = 2.0
"""After a transfer of ours late answers may come, and the vehicle's figures about its mission may be old ones."""
_OF_A_TRANSFER = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
_WRITES = ("MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL")
"""How a ground station begins to replace a mission."""
PLAN_RECEIVED = "Flight plan received"
UNKNOWN_MISSION = "unknown"
"""No digest is this."""
OTHER_PLACES = "other places"
"""No digest is this: the mission was started with another fence, or other rally points."""
OTHER_HOME = "another home"
"""No digest is this: home was set elsewhere since, from where its heights count."""
PERHAPS_OTHER_HOME = "perhaps another home"
"""No digest is this: home was ordered elsewhere, and the vehicle did not tell whether it took that."""
HOME_MOVED = (
    "The mission on board was certified for the home before: its heights count from the new one. The vehicle holds."
    " Certify the rest from here (Fly, On board), return home, or land."
)
HOME_PERHAPS_MOVED = (
    "Home may have been moved, and the vehicle began to fly what was certified for the home before. The vehicle holds."
    " Certify the rest from here (Fly, On board), return home, or land."
)
HOME_WORDS = {OTHER_HOME: HOME_MOVED, PERHAPS_OTHER_HOME: HOME_PERHAPS_MOVED}
FOREIGN_MISSION = (
    "The mission on board is not the one that was started any more: another ground station has written to it."
    " The vehicle holds. Return home or land."
)
NOT_TAKEN_UP = (
    "The vehicle began to fly what was sent to it from here in this flight and was not taken up: somebody else"
    " changed its mode. The vehicle holds. Take the plan up again, return home or land."
)


@dataclass(frozen=True, slots=True)
class Started:
    """Which mission a flight goes on with, for this link node and the next."""

    digest: str | None = None
    """Of the mission that was started from here."""
    begins: TakeUp | None = None
    """Where a mission that was taken up in flight begins, until it is flown."""
    replaced_here: bool = False
    """Since then lists were sent from here in flight, and were not taken up."""


class OnBoard:
    """``state`` as in ``LinkStatus.mission_state``; ``mission`` and ``fence`` are what the last read-backs found."""

    def __init__(self) -> None:
        self.mission: OnboardMission | None = None
        self.fence = FenceAboard()
        self.is_written_by_others = False
        """Somebody else was seen to replace it since it was last sent from here."""
        self._transferring = False
        self._settled_s = self._counted_s = 0.0
        self._seen: tuple[int | None, int | None] | None = None

    @property
    def state(self) -> Literal["unknown", "none", "verified"]:
        if self.mission is None:
            return "unknown"
        return "verified" if self.mission.items else "none"

    @property
    def digest(self) -> str | None:
        return self.mission.digest if self.mission else None

    def transfer_begins(self, *, replaces: bool) -> None:
        self._transferring = True
        if replaces:
            self.mission, self.is_written_by_others = None, False

    def transfer_ends(self, mission: OnboardMission | None, now_s: float) -> None:
        """``mission`` None: it failed."""
        self._transferring, self._settled_s, self._seen = False, now_s + SETTLE_S, None
        if mission is not None:
            self.mission = mission

    def forget(self, *, restarted: bool = False) -> None:
        """The vehicle restarted, or may have: which kinds of its fence act is forgotten only where it has."""
        self.mission, self._seen = None, None
        if restarted:
            self.fence.kinds.forget()
        self.fence.forget("has not been read back since the vehicle was silent or restarted")

    def on_message(self, message: Message, now_s: float, *, bytewise: bool = False) -> bool:
        """True when this message shows that somebody else has replaced the mission: it is unknown from now on.

        ``bytewise``: how the vehicle sends parameters that are integers.
        """
        kind = message.get_type()
        if kind == "PARAM_VALUE" and message.param_id in FENCE_PARAMETERS:
            self.fence.take({message.param_id: parameter_value(message, bytewise=bytewise)})
        if self._transferring:
            return False
        if kind == "MISSION_CURRENT":
            self._counted_s = now_s
        if kind == "STATUSTEXT":  # of an upload of ours it comes before the read-back
            return self._lose() if message.text.startswith(PLAN_RECEIVED) else False
        transfer = kind in _OF_A_TRANSFER and message.mission_type == 0
        return self._lose() if transfer and now_s >= self._settled_s else False

    def on_foreign(self, message: Message, system: int) -> bool:
        """The same, from what another ground station is heard to send to the vehicle with this system id."""
        is_write = message.get_type() in _WRITES and getattr(message, "mission_type", 0) == 0
        return self._lose() if is_write and message.target_system in (0, system) else False

    def on_state(self, state: VehicleState, now_s: float) -> bool:
        """The same, from the number of items and the mission's id."""
        if self._transferring or now_s < self._settled_s or state.mission_item is None:
            return False
        seen, self._seen = self._seen, (state.mission_items, state.mission_id)
        changed = seen is not None and seen != self._seen
        return self._lose() if changed or not self._fits(state) else False

    def _fits(self, state: VehicleState) -> bool:
        """Whether the vehicle counts as many items as were read back, where it counts them at all."""
        if self.mission is None or self._counted_s < self._settled_s:
            return True
        return state.mission_items in (None, len(self.mission.items))

    def _lose(self) -> bool:
        was_known, self.is_written_by_others = self.mission is not None, True
        self.mission = None
        return was_known


def check_same_mission(onboard: OnBoard, digest: str) -> None:
    """Raises MissionUnknownError when another station may have replaced what was checked."""
    if onboard.digest == digest:
        return
    what = "What is on board is not known any more" if onboard.digest is None else "Another mission is on board"
    raise MissionUnknownError(
        f"{what}: it was replaced since it was checked.",
        advice="Return home, then upload the plan and check it again.",
    )


def check_begins(request: TakeUp | FlyWay, state: VehicleState) -> None:
    """Raises NotAllowedError unless the vehicle holds still where what it is to fly was certified to begin."""
    if (refusal := why_not_from(request, state, time.monotonic())) is not None:
        raise refusal


class UnderWay:
    """The mission of the flight that is under way: ``started`` changes only by the calls below."""

    def __init__(self, onboard: OnBoard) -> None:
        self._onboard, self.started = onboard, Started()
        self._steady = Steady()
        self._is_inherited = self._known_foreign = False
        """Of a link node before this one, and not held against what is on board yet. The alarm has been raised."""

    def begin(self, digest: str | None, begins: TakeUp | None = None) -> None:
        self.started, self._is_inherited, self._steady = Started(digest, begins), False, Steady()

    def inherit(self, started: Started) -> None:
        self.started, self._is_inherited = started, True

    def replaces(self) -> None:
        """What is on board is replaced: it is not flown before it is taken up."""
        digest = self.started.digest or self._onboard.digest or UNKNOWN_MISSION
        self.started = Started(digest, self.started.begins, replaced_here=True)

    def replaces_places(self) -> None:
        """Fence or rally points are: the mission on board was not certified with those that come."""
        self.started, self._is_inherited = Started(OTHER_PLACES, replaced_here=True), False

    def moves_home(self, *, perhaps: bool = False) -> Started:
        """The mission on board was not certified for the home that comes; ``perhaps``: nobody knows whether it came."""
        self.begin(PERHAPS_OTHER_HOME if perhaps else OTHER_HOME)
        return self.started

    def stays_home(self, before: Started, ordered: Started) -> None:
        """The vehicle has refused what was ``ordered``: what was under way before may go on. Not where home was moved
        otherwise meanwhile."""
        if self.started is ordered:
            self.started = before

    def check_home(self) -> None:
        """Raises NotAllowedError where the flight's heights count from another home than they were certified for."""
        digest, advice = self.started.digest, "Certify the rest from here (Fly, On board), return home, or land."
        if digest == PERHAPS_OTHER_HOME:
            what = "Home may have been moved: the vehicle has not told whether it took the order."
            raise NotAllowedError(what, advice=advice)
        if digest == OTHER_HOME:
            what = "The mission on board was certified for the home before: its heights count from the new one."
            raise NotAllowedError(what, advice=advice)

    def on_state(self, state: VehicleState) -> None:
        if _flies_mission(state) and self.started.begins is not None:
            self.started = replace(self.started, begins=None)
        if self._onboard.mission is not None:
            self._is_inherited = False

    @property
    def must_be_read(self) -> bool:
        """A link node before this one knew what was on board, and this one does not yet."""
        return self._is_inherited and self._onboard.mission is None and self.started.digest is not None

    def check_goes_on(self, state: VehicleState) -> None:
        """Raises MissionUnknownError, or NotAllowedError elsewhere than where it begins."""
        self.check_home()
        if self.started.digest == OTHER_PLACES:
            what = "The mission on board is not certified with the fence and rally points that were sent since."
            raise NotAllowedError(what, advice="Take the plan up again, return home, or land.")
        if self.started.digest is not None:
            check_same_mission(self._onboard, self.started.digest)
        if self.started.begins is not None:
            now_s = time.monotonic()
            refusal = self._steady.shown(why_not_gone_on(self.started.begins, state, now_s), now_s)
            if refusal is not None:
                raise refusal

    @property
    def why_foreign(self) -> str:
        """What is said of a mission that ``turns_foreign``: whose it is, or why it does not hold any more."""
        if self.started.digest in HOME_WORDS:
            return HOME_WORDS[self.started.digest]
        is_ours = self.started.replaced_here and not self._onboard.is_written_by_others
        return NOT_TAKEN_UP if is_ours else FOREIGN_MISSION

    def turns_foreign(self, state: VehicleState) -> bool:
        """The vehicle flies by another mission than the one that was started: true once."""
        digest = self.started.digest
        if digest is None or self._is_inherited or self._onboard.digest == digest:
            self._known_foreign = False
            return False
        is_first = _flies_mission(state) and not self._known_foreign
        self._known_foreign = self._known_foreign or is_first
        return is_first


def _flies_mission(state: VehicleState) -> bool:
    return state.armed and state.mode == MISSION_MODES.get(state.autopilot, "AUTO")
