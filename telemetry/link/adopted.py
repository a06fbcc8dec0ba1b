"""The adopted vehicle: its state, its link's quality, and the conversations with it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, cast

from planning.basics.plan_model import Firmware
from telemetry.errors import NotAllowedError, RefusedError, SilentError
from telemetry.flight.fence_kinds import untaken_words
from telemetry.link.exchanges import Exchanges
from telemetry.link.heartbeat import heartbeat
from telemetry.link.line import Line
from telemetry.link.onboard import OnBoard
from telemetry.link.streams import StreamRequests
from telemetry.link.ways.choosing import ChangeOver, Ways
from telemetry.link.ways.way import LinkWay
from telemetry.mavlink.actions import Message
from telemetry.mavlink.autopilot_orders import Order, Orders
from telemetry.mavlink.believing import CLOCKED, MOTORS_DOUBTED, Believing
from telemetry.mavlink.commands import CommandRun
from telemetry.mavlink.conversation import BootClock
from telemetry.mavlink.parameters.values import BYTEWISE
from telemetry.mavlink.reduce import reduce
from telemetry.mavlink.texts import HeardWords, Speech
from telemetry.topics.messages import LOST_S, STALE_S, Candidate
from telemetry.topics.vehicle import Autopilot, VehicleState

FAST_LINK_BAUD = 400_000
ALERT, WARNING, INFO = 1, 4, 6
"""MAV_SEVERITY"""
SIMULATION = b"hedgehop"
"""What Hedgehop's own simulated vehicle says for its firmware's version; others have a hash of their sources there."""


@dataclass(frozen=True, slots=True)
class Telling:
    """Whom the vehicle tells. ``unsure``: the mission on board may be another one than the one last read back."""

    state: Callable[[VehicleState], None]
    text: Callable[[int, str], None]
    unsure: Callable[[], None]
    sent: Callable[[bytes], None]
    ordered: Callable[[Message], None] = lambda _: None
    """Every message before it goes out."""
    sent_spare: Callable[[str, bytes], None] = lambda *_: None
    """A question or a heartbeat over a way that is not in use: address, frame."""
    changed_over: Callable[[str], None] = lambda _: None
    """Another way is in use: what is written down of it."""


class AdoptedVehicle:
    def __init__(
        self, candidate: Candidate, line: Line, telling: Telling, clock: Callable[[], float], *, flies: bool = False
    ) -> None:
        """``flies``: a flight of it is under way, as the node before this one knew."""
        now_s = clock()
        self.candidate = candidate
        self.ways, self._lines = Ways(candidate, now_s), {candidate.address: line}
        self.target = (candidate.system_id, candidate.component_id)
        self.state = VehicleState(
            system_id=candidate.system_id,
            component_id=candidate.component_id,
            autopilot=cast(Autopilot, candidate.autopilot),
            vehicle_type=candidate.vehicle_type,
        )
        self.onboard = OnBoard()
        self.exchanges = Exchanges(self.send, clock)
        self.heard_s = now_s
        self.capabilities: int | None = None
        self.is_simulation = False
        """Hedgehop's own, as it says with its capabilities."""
        self._telling, self._clock = telling, clock
        self._streams = self._requests(now_s)
        self._streams_of = {candidate.address: self._streams}
        """By way: autopilots send what was asked for on the way that it was asked on."""
        self.believing, self._doubted = Believing(flies=flies), False
        self._boot, self._speech = BootClock(), Speech(self.target)
        self._next_state: asyncio.Future[None] | None = None

    @property
    def line(self) -> Line:
        """That is in use."""
        return self._lines[self.ways.chosen.address]

    @property
    def orders(self) -> Orders:
        return Orders(self.target, self.state.autopilot)

    @property
    def firmware(self) -> Firmware:
        """Which of the two mission protocols it speaks; only ArduPilot has a home row."""
        return "ardupilot" if self.candidate.autopilot == "ardupilot" else "px4"

    @property
    def sends_integers_bytewise(self) -> bool:
        if self.capabilities is None:
            return self.firmware == "px4"
        return bool(self.capabilities & BYTEWISE)

    @property
    def silent_s(self) -> float:
        return self._clock() - self.heard_s

    @property
    def link_state(self) -> Literal["live", "stale", "lost"]:
        silent_s = self.silent_s
        if silent_s < STALE_S:
            return "live"
        return "stale" if silent_s < LOST_S else "lost"

    @property
    def quality(self) -> float | None:
        return self.ways.chosen.quality.share(self._clock())

    @property
    def round_trip_s(self) -> float | None:
        return self.ways.chosen.round_trip_s(self._clock())

    @property
    def may_fly(self) -> bool:
        """It is not known to be disarmed."""
        return self.state.heartbeat_t_mono_s is None or self.state.armed

    def moved(self, candidate: Candidate, line: Line) -> None:
        """It sends from another port now, as the operator says."""
        self.candidate = candidate
        self.ways, self._lines = Ways(candidate, self._clock()), {candidate.address: line}
        self._streams_of = {candidate.address: self._streams}
        self.send_first()

    def ask_way(self, candidate: Candidate, line: Line) -> None:
        """Somebody with its numbers is heard there too. A heartbeat: some vehicles answer nobody without."""
        self.ways.add(candidate)
        self._lines[candidate.address] = line
        self._streams_of.pop(candidate.address, None)
        way = self.ways.get(candidate.address)
        if way is not None:
            self._send_over(way, heartbeat())

    def way_gone(self, address: str) -> None:
        """The far end hung up."""
        way = self.ways.get(address)
        if way is not None and self.ways.has_several:
            way.gone()

    def part_ways(self) -> list[LinkWay]:
        """Those that turned out to lead to another vehicle, or that nobody can tell of."""
        self.ways.lapse(self._clock())
        parted = self.ways.part(self._clock())
        for way in parted:
            del self._lines[way.address]
            self._streams_of.pop(way.address, None)
        return parted

    def leave_way(self, address: str) -> bool:
        """The connection is taken away. False: no other one leads to the vehicle. Raises NotAllowedError for the last
        one over which a vehicle is heard that may fly.
        """
        way, now_s = self.ways.get(address), self._clock()
        if way is None:
            return True
        if (
            way is self.ways.chosen
            and not self.ways.has_other_live(address, now_s)
            and not self._may_be_left(way, now_s)
        ):
            return False
        change = self.ways.remove(address, now_s)
        if change is not None:
            self._change_over(change, now_s)
        del self._lines[address]
        self._streams_of.pop(address, None)
        if self.candidate.address == address:
            self.candidate = self.ways.chosen.candidate
        return True

    def _may_be_left(self, way: LinkWay, now_s: float) -> bool:
        """When all others are silent."""
        if way.is_lost(now_s):
            return self.ways.has_other_known(way.address)
        if self.may_fly and self.ways.was_reached_beside(way.address):
            what = f"The vehicle may be flying, and it is heard over {way.address} alone: the other ways are silent."
            raise NotAllowedError(what, advice="Land and disarm it, or release it first.")
        return False

    def send_first(self) -> None:
        """A heartbeat at once: some vehicles answer nobody whose heartbeat they have not heard."""
        self.send(heartbeat())
        self.on_tick()

    def tell(self, severity: int, text: str) -> None:
        """Words of the link's own about the vehicle."""
        self._telling.text(severity, text)

    def send(self, message: Message) -> None:
        self._telling.ordered(message)
        self._send_over(self.ways.chosen, message)

    def _send_over(self, way: LinkWay, message: Message) -> None:
        frame = self._lines[way.address].send(message, way.candidate.peer)
        if frame is None:
            return
        if way is self.ways.chosen:
            self._telling.sent(frame)
        else:
            self._telling.sent_spare(way.address, frame)

    def on_message(self, message: Message, t_utc_s: float, *, address: str | None = None) -> tuple[Message, ...]:
        """Any message of its system; those of its other components are only shown to the machines. ``address``: of
        the way that it came; None: of the one in use.

        What of it is believed by now: this message, none, or one from before as well.
        """
        now_s, believed = self._clock(), (message,)
        address = address or self.ways.chosen.address
        if message.get_srcComponent() == self.target[1]:
            believed = self.believing.hear(self.state, message, now_s)
            self._tell_doubt(now_s)
        for each in believed:
            self._believe(each, now_s, t_utc_s, address)
        return believed

    def on_spare(self, message: Message, address: str) -> None:
        """A copy, or what is taken from the way in use alone: it tells of the way, and that the vehicle is there."""
        if message.get_srcComponent() == self.target[1]:
            self._on_heard_over(message, self._clock(), address)

    def _on_heard_over(self, message: Message, now_s: float, address: str) -> None:
        if self.ways.is_known(address):
            if now_s - self.heard_s > LOST_S:
                self._came_back(now_s)
            self.heard_s = now_s
        self.ways.hear(address, message, now_s)

    def _believe(self, message: Message, now_s: float, t_utc_s: float, address: str) -> None:
        if message.get_srcComponent() == self.target[1]:
            self._on_heard_over(message, now_s, address)
            self._on_own(message, now_s)
        new = reduce(self.state, message, t_mono_s=now_s, t_utc_s=t_utc_s)
        self.exchanges.on_message(message)
        if new is not None and new is not self.state:
            self._on_state(new, now_s)

    def on_foreign(self, message: Message) -> None:
        """Of another ground station on the same link."""
        if self.onboard.on_foreign(message, self.target[0]):
            self._telling.unsure()

    def on_tick(self) -> None:
        now_s = self._clock()
        self.exchanges.on_tick()
        for message in self._streams.on_tick(now_s):
            self.send(message)
        for way, question in self.ways.on_tick(now_s):
            self._send_over(way, question)
        if (change := self.ways.choose(now_s)) is not None:
            self._change_over(change, now_s)
        self._on_heard(self._speech.on_tick(now_s), now_s)

    async def obey(self, order: Order) -> None:
        """Sends a command until it is answered. Raises RefusedError with the vehicle's own words, SilentError."""
        run = CommandRun(order.message, target=self.target, once=order.once, confirm=order.seen)
        await self.exchanges.run(run)

    async def wait_until(self, seen: Callable[[VehicleState], bool], *, timeout_s: float, what: str) -> None:
        """Raises SilentError when the state does not show it in time."""
        try:
            async with asyncio.timeout(timeout_s):
                while not seen(self.state):
                    await self._another_state()
        except TimeoutError:
            advice = "Look at the vehicle: it holds its position or does what its own failsafe says."
            raise SilentError(f"The vehicle did not {what} within {timeout_s:.0f} s.", advice=advice) from None

    async def obey_first(self, *orders: Order) -> None:
        """The first of several ways to the same end that the vehicle does not refuse."""
        for order in orders[:-1]:
            try:
                await self.obey(order)
            except RefusedError:
                continue
            return
        await self.obey(orders[-1])

    def _on_own(self, message: Message, now_s: float) -> None:
        self._streams.on_message(message, now_s)
        if message.get_type() == "AUTOPILOT_VERSION":
            self.capabilities = message.capabilities
            self.is_simulation = bytes(message.flight_custom_version) == SIMULATION
        if message.get_type() in CLOCKED and self._boot.has_restarted(message):
            self._restarted(now_s)
        if self.onboard.on_message(message, now_s, bytewise=self.sends_integers_bytewise):
            self._telling.unsure()
        self._tell_kinds(now_s)
        self._on_heard(self._speech.on_message(message, now_s), now_s)

    def _on_heard(self, heard: HeardWords, now_s: float) -> None:
        for severity, text in heard.texts:
            self._telling.text(severity, text)
        if heard.reasons is not None:
            self._on_state(replace(self.state, not_ready_words=heard.reasons, not_ready_t_mono_s=now_s), now_s)
        for request in self._speech.take_requests():
            self.send(request)
        if not self.state.armed and self._speech.take_wish():
            self.send(self.orders.check_before_arming())

    def _tell_kinds(self, now_s: float) -> None:
        """Of its fence, once for each change."""
        untaken, before = self.onboard.fence.kinds.untaken, self.state.fence_kinds_untaken
        if untaken == before:
            return
        if words := untaken_words(untaken & ~before):
            self._telling.text(WARNING, words)
        self._on_state(replace(self.state, fence_kinds_untaken=untaken), now_s)

    def _tell_doubt(self, now_s: float) -> None:
        """Once for each time: a real crash disarms in the air, too."""
        before, self._doubted = self._doubted, self.believing.doubts_motors(now_s)
        if self._doubted and not before:
            self._telling.text(ALERT, MOTORS_DOUBTED)

    def _on_state(self, state: VehicleState, now_s: float) -> None:
        self.state = state
        self.exchanges.on_state(state)
        if self.onboard.on_state(state, now_s):
            self._telling.unsure()
        if self._next_state is not None:
            self._next_state.set_result(None)
            self._next_state = None
        self._telling.state(state)

    def _change_over(self, change: ChangeOver, now_s: float) -> None:
        """What was not asked for on this way yet is."""
        kept = self._streams_of.get(change.now.address)
        if kept is not None:
            kept.go_on(now_s)
        self._streams = self._streams_of[change.now.address] = kept or self._requests(now_s)
        text = f"Link: now over {change.now.address}, not {change.before.address}: {change.why}."
        self._telling.text(WARNING if change.is_loss else INFO, text)
        self._telling.changed_over(text)

    def _requests(self, now_s: float) -> StreamRequests:
        address = self.line.address
        slow = address.kind == "serial" and address.baud < FAST_LINK_BAUD
        return StreamRequests(self.target, self.candidate.autopilot, slow=slow, now_s=now_s)

    def _ask_anew(self, now_s: float) -> None:
        """It may have forgotten what was asked, on every way."""
        self._streams.restart(now_s)
        self._streams_of = {self.ways.chosen.address: self._streams}

    def _came_back(self, now_s: float) -> None:
        """After so long a silence it may have been restarted; in flight its boot clock will tell."""
        self._ask_anew(now_s)
        if not self.state.armed:
            self.onboard.forget()
            self._telling.unsure()

    def _restarted(self, now_s: float) -> None:
        self._boot, self._speech = BootClock(), Speech(self.target)
        self._ask_anew(now_s)
        self.onboard.forget(restarted=True)
        self._telling.unsure()

    async def _another_state(self) -> None:
        if self._next_state is None:
            self._next_state = asyncio.get_running_loop().create_future()
        await asyncio.shield(self._next_state)
