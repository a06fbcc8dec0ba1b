"""Handing a list's items to a vehicle, sans-IO, until it says that it has them or nothing more can be learnt."""

from __future__ import annotations

from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Firmware
from telemetry.errors import SilentError, TelemetryError
from telemetry.mavlink.actions import Action, Failed, Message, Progress, Send
from telemetry.mavlink.conversation import Endpoints, ItemList, RoundTrip
from telemetry.mavlink.items import home_message, item_message
from telemetry.mavlink.refusals import (
    ACCEPTED,
    DENIED,
    INVALID_SEQUENCE,
    NO_SPACE,
    OF_AN_ITEM,
    TRANSFER_IS_GONE,
    Refusal,
    broken_off,
    refusal_error,
)
from telemetry.mavlink.texts import VehicleWords
from telemetry.topics.onboard_lists import Item

COUNT_EVERY_S = 0.5
GENTLE_RESEND_S = 1.0
"""After a spoilt upload: MAVSDK's vehicles store an item twice that comes twice, but soon ask again by themselves."""
LAST_ACK_S = 2.0
"""Without an answer to the last item, the read-back tells how it went."""
WORDS_S = 0.4
"""A vehicle's words follow its refusal."""
BEGIN_AGAIN_S, SILENT_S = 5.0, 15.0
REFUSED_S = 10.0
"""An upload that another ground station abandoned is given up by the vehicle after 8 s."""
ATTEMPTS = 6


class MissionSending:
    """``is_complete``: time to read back. It is still to be fed then: the vehicle may turn out to lack an item."""

    def __init__(
        self,
        items: tuple[Item, ...],
        home: tuple[float, float, float],
        *,
        firmware: Firmware,
        endpoints: Endpoints,
        about: ItemList,
        now_s: float,
    ) -> None:
        self._items, self._endpoints, self._about = items, endpoints, about
        self.rows_before = int(about.has_home_row(firmware))
        """Rows that the vehicle keeps before the first item: ArduPilot's home."""
        self._rows = self._encode(items, home, firmware)
        self.disturbed = False
        """Something was lost or came twice in this attempt."""
        self._words = VehicleWords()
        self._phase: Literal["count", "items", "complete"] = "count"
        self._round_trip, self._in_pairs, self._is_px4 = RoundTrip(), True, firmware == "px4"
        self._attempts = 0
        self._seq = self._asked = self._highest_sent = self._furthest = -1
        self._refusal: tuple[Refusal, float] | None = None
        self._refused_since_s: float | None = None
        self._heard_s = self._any_heard_s = self._moved_s = self._sent_s = now_s

    def _encode(
        self, items: tuple[Item, ...], home: tuple[float, float, float], firmware: Firmware
    ) -> tuple[Message, ...]:
        target, first, kind = self._endpoints.vehicle, self.rows_before, self._about.mission_type
        rows = tuple(
            item_message(item, seq, target=target, number=seq + 1 - first, firmware=firmware, mission_type=kind)
            for seq, item in enumerate(items, start=first)
        )
        return (home_message(*home, target=target), *rows) if first else rows

    @property
    def is_complete(self) -> bool:
        return self._phase == "complete"

    def begin(self, now_s: float, *, gently: bool = False) -> list[Action]:
        """The first time, and again after a read-back that showed something else."""
        if gently:
            self._round_trip = RoundTrip(unknown_s=GENTLE_RESEND_S, shortest_s=GENTLE_RESEND_S)
        self._attempts += 1
        if self._attempts > ATTEMPTS:
            return [Failed(self.broken_off())]
        self._phase, self.disturbed = "count", False
        self._seq = self._asked = self._highest_sent = -1
        self._heard_s = now_s
        return self._send_count(now_s)

    @property
    def may_begin_again(self) -> bool:
        return self._attempts < ATTEMPTS

    def broken_off(self) -> TelemetryError:
        return broken_off(max(self._furthest + 1 - self.rows_before, 0), len(self._items), self._words, self._about)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        """Of the vehicle."""
        self._any_heard_s = now_s
        self._words.on_message(message)
        kind = message.get_type()
        if kind not in ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK") or self._refusal is not None:
            return []
        if not self._endpoints.is_for_us(message) or message.mission_type != self._about.mission_type:
            return []
        self._heard_s = now_s
        return self._on_ack(message.type, now_s) if kind == "MISSION_ACK" else self._on_request(message.seq, now_s)

    def on_tick(self, now_s: float) -> list[Action]:
        if self._refusal is not None:
            refusal, until_s = self._refusal
            return [Failed(refusal_error(refusal, self._items, self._words, self._about))] if now_s >= until_s else []
        if self._phase == "complete":
            return []
        if now_s - self._heard_s > SILENT_S:
            return [Failed(self._silent(now_s))]
        if self._phase == "count":
            return self._send_count(now_s) if now_s - self._sent_s >= COUNT_EVERY_S else []
        return self._on_tick_of_items(now_s)

    def _on_tick_of_items(self, now_s: float) -> list[Action]:
        if self._highest_sent == len(self._rows) - 1 and now_s - self._moved_s >= LAST_ACK_S:
            return self._complete()
        if now_s - self._heard_s >= BEGIN_AGAIN_S and self._seq >= 0:
            return self._ask_anew(now_s)
        if now_s - self._sent_s >= self._round_trip.patience_s:
            return self._resend(now_s)
        return []

    def _ask_anew(self, now_s: float) -> list[Action]:
        """The vehicle may have given the transfer up unheard. It stays silent: that is still counted."""
        heard_s = self._heard_s
        actions = self.begin(now_s)
        self._heard_s = heard_s
        return actions

    def _resend(self, now_s: float) -> list[Action]:
        """Either the item or the request for the next one was lost. Vehicles take the next one without asking."""
        self.disturbed = True
        self._round_trip.repeats()
        more = self._send_row(self._seq + 1, now_s) if self._in_pairs and not self._is_last else []
        return [*self._send_row(self._seq, now_s), *more]

    @property
    def _is_last(self) -> bool:
        return self._seq == len(self._rows) - 1

    @property
    def _number(self) -> int:
        """Of the item that the vehicle is at; 0 is home."""
        return max(self._seq + 1 - self.rows_before, 0)

    def _complete(self) -> list[Action]:
        self._phase = "complete"
        return []

    def _send_count(self, now_s: float) -> list[Action]:
        self._sent_s = now_s
        count = (len(self._rows), self._about.mission_type)
        return [Send(mavlink.MAVLink_mission_count_message(*self._endpoints.vehicle, *count))]

    def _send_row(self, seq: int, now_s: float) -> list[Action]:
        self._sent_s, self._highest_sent = now_s, max(seq, self._highest_sent)
        return [Send(self._rows[seq])]

    def _on_request(self, seq: int, now_s: float) -> list[Action]:
        """Whatever the vehicle asks for it gets, also when it should have had it long ago."""
        self._refused_since_s = None
        if seq >= len(self._rows):
            return []
        if self._phase != "items":
            self._phase, self._moved_s = "items", now_s
        elif seq == self._seq and self._is_on_its_way(now_s):
            return []
        elif seq == self._seq + 1 and (self._moved_s == self._sent_s or self._round_trip.mean_s is None):
            self._round_trip.measure(now_s - self._moved_s)
        self.disturbed |= seq != self._seq + 1
        if not self._is_late(seq) and seq != self._seq:
            self._seq, self._moved_s = seq, now_s
            self._furthest = max(seq, self._furthest)
        self._asked = seq
        # PX4 passes over an item that it does not want yet, and takes it without asking if it does.
        ahead = self._is_px4 and self._in_pairs and self.disturbed and seq + 1 < len(self._rows)
        more = self._send_row(seq + 1, now_s) if ahead else []
        progress = Progress("sending", max(seq - self.rows_before, 0), len(self._items))
        return [progress, *self._send_row(seq, now_s), *more]

    def _is_on_its_way(self, now_s: float) -> bool:
        """PX4 asks again after a quarter of a second, also where the way there and back takes longer."""
        return now_s - self._sent_s < (self._round_trip.mean_s or 0.0)

    def _is_late(self, seq: int) -> bool:
        """An old request that came the long way; one that begins again goes on asking."""
        return seq < self._seq and seq not in (self._asked, self._asked + 1)

    def _on_ack(self, result: int, now_s: float) -> list[Action]:
        if result == NO_SPACE:
            return self._refused(Refusal(NO_SPACE), now_s)
        if self._phase == "complete":
            return self._on_ack_when_complete(result, now_s)
        if self._phase == "count":
            return self._on_ack_of_count(result, now_s)
        if result in OF_AN_ITEM:
            return self._on_bad_item(result, now_s)
        if result == INVALID_SEQUENCE:
            return []  # it has that item already; the transfer goes on
        if self._highest_sent == len(self._rows) - 1:
            return self._complete()
        return self.begin(now_s) if result in TRANSFER_IS_GONE else []

    def _on_ack_when_complete(self, result: int, now_s: float) -> list[Action]:
        """No reading is allowed while the vehicle is waiting for an item, the last one most likely."""
        if result != DENIED:
            return []
        if self._seq < 0:
            return self.begin(now_s)
        self._phase, self._moved_s = "items", now_s
        return self._send_row(self._seq, now_s)

    def _on_ack_of_count(self, result: int, now_s: float) -> list[Action]:
        """Late acks of an earlier transfer are likely here: only what is said again and again is believed."""
        if result == ACCEPTED:
            return self._complete()
        if self._refused_since_s is None:
            self._refused_since_s = now_s
        return self._refused(Refusal(result), now_s) if now_s - self._refused_since_s > REFUSED_S else []

    def _on_bad_item(self, result: int, now_s: float) -> list[Action]:
        if self._highest_sent > self._seq:  # two were sent: once more, one at a time, to tell which of them it is
            self._in_pairs = False
            return self.begin(now_s)
        return self._refused(Refusal(result, self._number), now_s)

    def _refused(self, refusal: Refusal, now_s: float) -> list[Action]:
        self._refusal = (refusal, now_s + WORDS_S)
        return []

    def _silent(self, now_s: float) -> SilentError:
        heard = now_s - self._any_heard_s < SILENT_S / 2
        does = "is heard but does not answer the upload" if heard else "has fallen silent"
        number = self._furthest + 1 - self.rows_before
        at = f"at item {number} of {len(self._items)}" if number > 0 else "before the first item"
        return SilentError(f"The vehicle {does}, {at}.", advice=f"Check the link. {self._about.unknown}")
