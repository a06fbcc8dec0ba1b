"""Replacing the mission on board, its fence or its rally points, sans-IO, and reading it back: only what was read
back counts."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Firmware
from telemetry.errors import TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send, ended
from telemetry.mavlink.conversation import GROUND_STATION, MISSION, BootClock, Endpoints, ItemList
from telemetry.mavlink.download import MissionDownload
from telemetry.mavlink.refusals import CANCELLED
from telemetry.mavlink.sending import MissionSending
from telemetry.mavlink.verify import compare
from telemetry.topics.onboard_lists import Item, OnboardMission, UploadReport

LONGEST_S, LONGEST_PER_ITEM_S = 90.0, 4.0


class MissionUpload:
    """Ends in Done(UploadReport), or in Failed: then nobody knows what is on board.

    ``home``: lat_deg, lon_deg, alt_amsl_m for ArduPilot's home row, which the vehicle replaces by its own.
    ``about``: which of the vehicle's lists is replaced. Without items the vehicle's fence or rally points are cleared;
    a mission has some. Raises TransferError for a list that cannot be put on the wire at all.
    """

    def __init__(
        self,
        items: tuple[Item, ...],
        home: tuple[float, float, float],
        *,
        firmware: Firmware,
        target: tuple[int, int],
        own: tuple[int, int] = GROUND_STATION,
        about: ItemList = MISSION,
        now_s: float = 0.0,
    ) -> None:
        if not items and about is MISSION:
            raise TransferError("The mission has no items.", advice="Plan a mission first.")
        self._firmware: Firmware = firmware
        self._about = about
        self._items, self._endpoints, self._boot = items, Endpoints(target, own), BootClock()
        self._sending = MissionSending(
            items, home, firmware=firmware, endpoints=self._endpoints, about=about, now_s=now_s
        )
        self._download: MissionDownload | None = None
        self._over = False
        self._started_s = now_s

    def start(self, now_s: float) -> list[Action]:
        self._started_s = now_s
        return [Progress("sending", 0, len(self._items)), *self._sending.begin(now_s)]

    def cancel(self, now_s: float) -> list[Action]:
        kind = self._about.mission_type
        stop = Send(mavlink.MAVLink_mission_ack_message(*self._endpoints.vehicle, CANCELLED, kind))
        error = TransferError("The upload was cancelled.", advice=self._about.unknown)
        return [] if self._over else [stop, *self._end(Failed(error))]

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or not self._endpoints.is_from_vehicle(message):
            return []
        if self._boot.has_restarted(message):
            advice = f"Wait until it is ready. {self._about.unknown}"
            return self._end(Failed(TransferError("The vehicle restarted during the upload.", advice=advice)))
        actions = self._sending.on_message(message, now_s)
        if self._download is not None and self._sending.is_complete:
            actions += self._download.on_message(message, now_s)
        return self._settle(actions, now_s)

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._started_s > LONGEST_S + LONGEST_PER_ITEM_S * len(self._items):
            return self._end(Failed(self._sending.broken_off()))
        actions = self._sending.on_tick(now_s)
        if self._download is not None and self._sending.is_complete:
            actions += self._download.on_tick(now_s)
        return self._settle(actions, now_s)

    def _settle(self, actions: list[Action], now_s: float) -> list[Action]:
        """Passes actions on, turns the end of the read-back into the end of the upload, and begins the read-back."""
        end = ended(actions)
        if isinstance(end, Failed):
            return self._end(end)
        if isinstance(end, Done):
            before = [self._without_home(action) for action in actions if action is not end]
            return [*before, *self._report(end.result, now_s)]
        if not self._sending.is_complete:
            self._download = None
        elif self._download is None:
            actions = [*actions, *self._read_back(now_s)]
        return [self._without_home(action) for action in actions]

    def _without_home(self, action: Action) -> Action:
        if not isinstance(action, Progress) or action.phase != "reading_back":
            return action
        done, total = (max(rows - self._sending.rows_before, 0) for rows in (action.done, action.total))
        return Progress(action.phase, done, total)

    def _read_back(self, now_s: float) -> list[Action]:
        self._download = MissionDownload(
            firmware=self._firmware,
            target=self._endpoints.vehicle,
            own=self._endpoints.own,
            now_s=now_s,
            lossy=self._sending.disturbed,
            about=self._about,
        )
        return self._download.start(now_s)

    def _report(self, onboard: object, now_s: float) -> list[Action]:
        assert isinstance(onboard, OnboardMission)
        rounded, differences = compare(self._items, onboard.items, firmware=self._firmware)
        if differences and self._sending.disturbed and self._sending.may_begin_again:
            self._download = None  # what got lost or came twice may have spoilt it
            return self._sending.begin(now_s, gently=True)
        report = UploadReport(
            verified=not differences,
            onboard=onboard,
            rounded=rounded,
            differences=differences,
            seconds=now_s - self._started_s,
        )
        return self._end(Done(report))

    def _end(self, action: Done | Failed) -> list[Action]:
        self._over = True
        return [action]
