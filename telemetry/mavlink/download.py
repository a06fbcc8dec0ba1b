"""Reading the mission or another list on board, sans-IO: several items are asked for at once, until messages get
lost."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Firmware
from telemetry.errors import RefusedError, SilentError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import GROUND_STATION, MISSION, BootClock, Endpoints, ItemList, RoundTrip
from telemetry.mavlink.items import item_from_message
from telemetry.mavlink.verify import digest
from telemetry.topics.onboard_lists import Item, OnboardMission

LIST_EVERY_S = 0.25
BEGIN_AGAIN_S = (3.0, 8.0)
BEGIN_AGAIN_TRIES = 12
"""PX4 ends a reading that displeases it, and then answers no request any more."""
SILENT_S = 15.0
REFUSED_S = 10.0
"""A vehicle that is still receiving a mission says no, and gives an abandoned one up after 8 s."""
WINDOW = 8
LONGEST_S, LONGEST_PER_ITEM_S = 60.0, 2.0
ACCEPTED, DENIED, CANCELLED = 0, 14, 15


class MissionDownload:
    """Ends in Done(OnboardMission). ArduPilot answers any request, others only the next one: see ``_lost``."""

    def __init__(
        self,
        *,
        firmware: Firmware,
        target: tuple[int, int],
        own: tuple[int, int] = GROUND_STATION,
        now_s: float = 0.0,
        lossy: bool = False,
        about: ItemList = MISSION,
    ) -> None:
        """``lossy``: the link is known to lose messages."""
        self._firmware: Firmware = firmware
        self._endpoints, self._about = Endpoints(target, own), about
        self._window = 1 if lossy and firmware != "ardupilot" else WINDOW
        self._boot, self._round_trip = BootClock(), RoundTrip()
        self._over, self._most_items = False, 0
        self._refused_since_s: float | None = None
        self._heard_s = self._any_heard_s = self._started_s = self._moved_s = now_s
        self._forget()

    def _forget(self) -> None:
        self._count: int | None = None
        self._rows: dict[int, Message] = {}
        self._asked_s: dict[int, float] = {}
        self._asked_again: set[int] = set()
        self._next = 0
        """The first item that was not asked for."""
        self._list_s = -LIST_EVERY_S

    def start(self, now_s: float) -> list[Action]:
        self._heard_s = self._any_heard_s = self._started_s = now_s
        return self._ask_for_list(now_s)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        if self._over or not self._endpoints.is_from_vehicle(message):
            return []
        self._any_heard_s = now_s
        if self._boot.has_restarted(message):
            return self._fail(
                TransferError(f"The vehicle restarted while its {self._about.name} was read.", advice="Read it again.")
            )
        handler = {
            "MISSION_COUNT": self._on_count,
            "MISSION_ITEM_INT": self._on_item,
            "MISSION_ACK": self._on_ack,
        }.get(message.get_type())
        if handler is None or not self._endpoints.is_for_us(message):
            return []
        if message.mission_type != self._about.mission_type:
            return []
        self._heard_s = now_s
        return handler(message, now_s)

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._heard_s > SILENT_S:
            return self._fail(self._silent(now_s))
        if now_s - self._started_s > LONGEST_S + LONGEST_PER_ITEM_S * self._most_items:
            return self._fail(self._endless())
        if self._count is None:
            return self._ask_for_list(now_s) if now_s - self._list_s >= LIST_EVERY_S else []
        if now_s - self._moved_s >= self._begin_again_s:
            return self._begin_again(WINDOW if self._firmware == "ardupilot" else 1, now_s)
        lost = [seq for seq, at_s in self._asked_s.items() if now_s - at_s >= self._round_trip.patience_s]
        return self._lost(lost, now_s) if lost else []

    def cancel(self, now_s: float) -> list[Action]:
        error = TransferError(
            f"Reading the {self._about.name} was cancelled.", advice="Read it again before the start."
        )
        return [] if self._over else [self._ack(CANCELLED), *self._fail(error)]

    @property
    def _begin_again_s(self) -> float:
        shortest_s, longest_s = BEGIN_AGAIN_S
        return min(max(BEGIN_AGAIN_TRIES * self._round_trip.patience_s, shortest_s), longest_s)

    def _begin_again(self, window: int, now_s: float) -> list[Action]:
        """The link may have become slower than was learnt: repetitions that come late are what PX4 dislikes."""
        self._forget()
        self._window, self._round_trip = window, RoundTrip()
        return self._ask_for_list(now_s)

    def _ask_for_list(self, now_s: float) -> list[Action]:
        self._list_s = now_s
        kind = self._about.mission_type
        return [Send(mavlink.MAVLink_mission_request_list_message(*self._endpoints.vehicle, kind))]

    def _on_count(self, message: Message, now_s: float) -> list[Action]:
        if self._count == message.count:
            return []
        self._forget()
        self._count, self._refused_since_s, self._moved_s = message.count, None, now_s
        self._most_items = max(self._most_items, message.count)
        return self._ask(now_s)

    def _on_item(self, message: Message, now_s: float) -> list[Action]:
        asked_s = self._asked_s.pop(message.seq, None)
        if asked_s is None or self._count is None:
            return []  # of an earlier reading, or a repetition
        self._rows[message.seq], self._moved_s = message, now_s
        if message.seq not in self._asked_again:
            self._round_trip.measure(now_s - asked_s)
        progress = Progress("reading_back", len(self._rows), self._count)
        return [progress, *self._ask(now_s)]

    def _ask(self, now_s: float) -> list[Action]:
        """Fills the window with requests for the next missing items; ends when none is missing."""
        assert self._count is not None
        if len(self._rows) == self._count:
            return self._finish()
        first, room = self._next, self._window - len(self._asked_s)
        self._next = max(first, min(first + room, self._count))
        return [self._request(seq, now_s) for seq in range(first, self._next)]

    def _request(self, seq: int, now_s: float) -> Action:
        self._asked_s[seq] = now_s
        kind = self._about.mission_type
        return Send(mavlink.MAVLink_mission_request_int_message(*self._endpoints.vehicle, seq, kind))

    def _lost(self, lost: list[int], now_s: float) -> list[Action]:
        """ArduPilot: ask for what is missing, in any order. Others: from the gap on, one at a time from now on."""
        self._asked_again.update(lost)
        self._round_trip.repeats()
        if self._firmware == "ardupilot":
            return [self._request(seq, now_s) for seq in lost]
        gap, self._window = min(lost), 1
        self._next = gap + 1
        self._asked_s.clear()
        self._rows = {seq: row for seq, row in self._rows.items() if seq < gap}
        return [self._request(gap, now_s)]

    def _on_ack(self, message: Message, now_s: float) -> list[Action]:
        """A refusal: wait while an upload may still be open, begin again when the order of requests was disliked."""
        if message.type == ACCEPTED or (self._firmware == "ardupilot" and message.type != DENIED):
            return []  # the late end of an upload
        if self._refused_since_s is None:
            self._refused_since_s = now_s
        if now_s - self._refused_since_s > REFUSED_S:
            return self._fail(
                RefusedError(
                    f"The vehicle does not let its {self._about.name} be read now.",
                    advice="Wait until no other ground station is transferring one, then read it again.",
                )
            )
        if self._count is not None:
            return self._begin_again(1, now_s)
        return []

    def _finish(self) -> list[Action]:
        self._over = True
        return [self._ack(ACCEPTED), Done(self._onboard())]

    def _onboard(self) -> OnboardMission:
        rows = [self._rows[seq] for seq in range(len(self._rows))]
        items = tuple(map(item_from_message, rows))
        home: Item | None = None
        if self._about.has_home_row(self._firmware):
            home, items = (items[0], items[1:]) if items else (None, ())
        return OnboardMission(
            items=items,
            home_lat_deg=home and home.lat_deg,
            home_lon_deg=home and home.lon_deg,
            home_alt_amsl_m=home and home.alt_m,
            digest=digest(items),
        )

    def _ack(self, result: int) -> Action:
        kind = self._about.mission_type
        return Send(mavlink.MAVLink_mission_ack_message(*self._endpoints.vehicle, result, kind))

    def _fail(self, error: TransferError | RefusedError | SilentError) -> list[Action]:
        self._over = True
        return [Failed(error)]

    def _silent(self, now_s: float) -> SilentError:
        heard = now_s - self._any_heard_s < SILENT_S / 2
        known = f"{len(self._rows)} of {self._count} items came" if self._count is not None else "none of it came"
        about = self._about.name
        return SilentError(
            f"The vehicle {f'answers nothing about its {about}' if heard else 'has fallen silent'}: {known}.",
            advice=f"The {self._about.name} on board is unknown. Check the link and read it again.",
        )

    def _endless(self) -> TransferError:
        known = f"{len(self._rows)} of {self._count} items came" if self._count is not None else "none of it came"
        return TransferError(
            f"Reading the {self._about.name} took too long: {known}.",
            advice=f"The {self._about.name} on board is unknown. Improve the link and read it again.",
        )
