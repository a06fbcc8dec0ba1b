"""Each request to the link: who may ask it, what must hold for it, what is written down, and who carries it out."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple

from telemetry.errors import NotAllowedError, NoVehicleError, OvertakenError, TelemetryError
from telemetry.link.link import Link
from telemetry.link.piloting.pilot import Pilot
from telemetry.topics import requests
from telemetry.topics.parameters import MOST_CHANGES
from telemetry.topics.vehicle import VehicleState


class OperatorRight:
    """Requests of an operator whose lease was taken over are refused.

    Knows the highest fencing token it has seen, which outlives a restart of the node. No token can shut out all that
    come after it: one far ahead of the clock is not taken, nor kept when the clock has been set back behind it.
    """

    def __init__(self, highest: int = 0) -> None:
        self._highest = highest
        self.name = ""

    @property
    def highest(self) -> int:
        if self._highest > requests.highest_possible_token():
            self._highest = 0
        return self._highest

    def check(self, operator: requests.Operator) -> None:
        """Raises OvertakenError for a token lower than the highest one, NotAllowedError for an impossible one."""
        if operator.token < self.highest:
            by = f" by {self.name}" if self.name and self.name != operator.name else ""
            raise OvertakenError(
                f"{operator.name or 'This session'} is not in charge any more: control was taken over{by}.",
                advice="Take control again before you command the vehicle.",
            )
        if operator.token > requests.highest_possible_token():
            raise NotAllowedError(
                f"{operator.name or 'This session'} gave a token that no server issues: it is far ahead of the clock.",
                advice="Take control in the console.",
            )
        self._highest, self.name = operator.token, operator.name


class _Command(NamedTuple):
    """What needs no more than the pilot."""

    words: str
    carry_out: Callable[[Pilot], Awaitable[None]]
    live: bool = True
    """Not over a link that seems lost. Whatever makes a flight end well is tried over that, too."""
    must: bool = True
    """It is not sent unless it is in the audit log."""


_COMMANDS: dict[type, _Command] = {
    requests.Arm: _Command("arm", Pilot.arm),
    requests.Disarm: _Command("disarm", Pilot.disarm, must=False),
    requests.Pause: _Command("pause", Pilot.pause, live=False, must=False),
    requests.Resume: _Command("resume", Pilot.resume),
    requests.ReturnHome: _Command("return home", Pilot.return_home, live=False, must=False),
    requests.Land: _Command("land", Pilot.land, live=False, must=False),
    requests.StopMotors: _Command("stop the motors in the air", Pilot.stop_motors, live=False, must=False),
}


class Answering:
    """What ``telemetry.topics.requests`` promises for each; errors are DescribedErrors."""

    def __init__(self, link: Link, right: OperatorRight) -> None:
        self._link, self._right = link, right
        self._written: dict[int, str] = {}
        """Requests under way that were written down, by identity."""
        self._answers: dict[type, Callable[[Any], Awaitable[object]]] = {
            requests.Connect: self._connect,
            requests.Disconnect: self._disconnect,
            requests.Adopt: self._adopt,
            requests.Release: self._release,
            requests.SetSigning: self._set_signing,
            requests.Upload: self._upload,
            requests.Download: self._download,
            requests.UploadPlaces: self._upload_places,
            requests.TakeUp: self._take_up,
            requests.DownloadPlaces: self._download_places,
            requests.ReadParameters: self._read_parameters,
            requests.ListParameters: self._list_parameters,
            requests.ReadMetadata: self._read_metadata,
            requests.WriteParameters: self._write_parameters,
            requests.ListVehicleLogs: self._list_logs,
            requests.ReadVehicleLog: self._read_log,
            requests.HighestToken: self._highest_token,
            requests.TickPoint: self._tick_point,
            requests.NoteChecklist: self._note_checklist,
            requests.StartAuto: self._start_auto,
            requests.StartGuided: self._start_guided,
            requests.FlyWay: self._fly_way,
            requests.SetSpeed: self._set_speed,
            requests.SetHome: self._set_home,
            requests.SetAvoidance: self._set_avoidance,
            requests.FlyManoeuvre: self._fly_manoeuvre,
            requests.MayFlyManoeuvre: self._may_fly_manoeuvre,
            requests.FlyRest: self._fly_rest,
        }

    async def answer(self, request: requests.LinkRequest) -> object:
        if not isinstance(request, requests.Looks):
            self._right.check(request.operator)
        result = "no answer was waited for"
        try:
            answered = await self._carry_out(request)
            result = "done"
        except TelemetryError as error:
            result = f"not done: {error.what}"
            raise
        finally:
            self._settle(request, result)
        return answered

    async def _carry_out(self, request: requests.LinkRequest) -> object:
        if (command := _COMMANDS.get(type(request))) is not None:
            return await self._command(request, command)
        return await self._answers[type(request)](request)

    def _settle(self, request: Any, result: str) -> None:
        """Beside what was written down before: a refused command must not look like one that was carried out."""
        words = self._written.pop(id(request), None)
        if words is not None:
            self._link.spawn(self._link.commands.settle(request.operator, words, result))

    async def _command(self, request: requests.LinkRequest, command: _Command) -> None:
        pilot = self._link.need_session(live=command.live).pilot
        await self._record(request, command.words, must=command.must)
        await command.carry_out(pilot)

    async def _connect(self, request: requests.Connect) -> None:
        await self._link.connect(request.address, adopt=request.adopt, as_way=request.as_way)

    async def _disconnect(self, request: requests.Disconnect) -> None:
        self._link.disconnect(request.address)

    async def _adopt(self, request: requests.Adopt) -> None:
        candidate = self._link.peers.find(request.candidate, time.monotonic())
        if request.candidate in [place.id for place in self._link.peers.places]:
            return
        if candidate is None:
            what = f"{request.candidate!r} is not heard at the moment."
            raise NoVehicleError(what, advice="Wait until the vehicle's heartbeat is heard.")
        await self._record(request, f"adopt {candidate.id}")
        self._link.adopt(candidate)

    async def _release(self, request: requests.Release) -> None:
        await self._record(request, "release the vehicle")
        self._link.release()

    async def _set_signing(self, request: requests.SetSigning) -> None:
        session = self._link.need_session(live=request.enabled)
        if request.enabled:
            state = session.vehicle.state
            if state.armed or state.heartbeat_t_mono_s is None or session.pilot.flight.is_under_way:
                raise NotAllowedError("A key is given to a vehicle on the ground only.", advice="Land and disarm it.")
        words = "set up signing" if request.enabled else "switch signing off"
        await self._record(request, words, must=request.enabled)
        await session.set_signing(request.enabled)

    async def _upload(self, request: requests.Upload) -> object:
        session = self._link.need_session()
        _refuse_in_mission(session.pilot, request)
        await self._record(request, f"upload {len(request.items)} items{_HOLDING[request.while_holding]}")
        _refuse_in_mission(session.pilot, request)  # a start may have come while the disk was waited for
        session.pilot.replaces()
        report = await session.transfers.upload(request)
        session.pilot.uploaded(report.onboard)
        return report

    async def _download(self, request: requests.Download) -> object:
        transfers = self._link.need_session().transfers
        return await transfers.download()

    async def _upload_places(self, request: requests.UploadPlaces) -> object:
        session = self._link.need_session()
        _refuse_in_mission(session.pilot, request)
        words = f"upload {request.kind} of {len(request.items)} items" if request.items else f"clear {request.kind}"
        await self._record(request, f"{words}{_HOLDING[request.while_holding]}")
        _refuse_in_mission(session.pilot, request)  # a start may have come while the disk was waited for
        session.pilot.replaces(places=True)
        return await session.transfers.upload_places(request)

    async def _take_up(self, request: requests.TakeUp) -> None:
        session = self._link.need_session()
        _refuse_while(session.transfers.is_busy)
        await self._record(request, f"take up mission {request.digest[:12]} in flight")
        _refuse_while(session.transfers.is_busy)
        await session.pilot.take_up(request)

    async def _download_places(self, request: requests.DownloadPlaces) -> object:
        return await self._link.need_session().transfers.download_places(request.kind)

    async def _read_parameters(self, request: requests.ReadParameters) -> object:
        transfers = self._link.need_session().transfers
        return await transfers.read_parameters(request.names)

    async def _list_parameters(self, request: requests.ListParameters) -> object:
        del request
        return await self._link.need_session().transfers.list_parameters()

    async def _read_metadata(self, request: requests.ReadMetadata) -> object:
        return await self._link.need_session().transfers.read_metadata(request.known_crcs)

    async def _write_parameters(self, request: requests.WriteParameters) -> object:
        session, changes = self._link.need_session(), request.changes
        names = {change.name for change in changes}
        if not 0 < len(changes) == len(names) <= MOST_CHANGES:
            what = f"{len(changes)} changes of {len(names)} parameters were asked for at once."
            raise NotAllowedError(what, advice=f"Give each once, and at most {MOST_CHANGES}.")
        _refuse_armed(session.vehicle.state, request.even_armed)
        words = ", ".join(f"{change.name} {change.value:.9g}" for change in changes)
        await self._record(request, f"write {words}{' even armed' if request.even_armed else ''}")
        _refuse_armed(session.vehicle.state, request.even_armed)  # it may have been armed while the disk was waited for
        return await session.transfers.write_parameters(changes, even_armed=request.even_armed)

    async def _list_logs(self, request: requests.ListVehicleLogs) -> object:
        del request
        session = self._link.need_session()
        _refuse_while(session.transfers.is_busy)
        return await session.logs.list()

    async def _read_log(self, request: requests.ReadVehicleLog) -> object:
        session = self._link.need_session()
        _refuse_while(session.transfers.is_busy)
        return await session.logs.read(request)

    async def _highest_token(self, request: requests.HighestToken) -> int:
        del request
        return self._right.highest

    async def _tick_point(self, request: requests.TickPoint) -> None:
        self._link.need_session()
        what = "tick" if request.ticked else "take back the tick of"
        point = f"point {request.number} of {request.of} of the checklist of {request.profile}: {request.text}"
        await self._record(request, f"{what} {point}{f' (by {request.by})' if request.by else ''}")

    async def _note_checklist(self, request: requests.NoteChecklist) -> None:
        if not request.changed:
            self._link.need_session()
        text = f"{request.points} points, SHA-256 {request.digest[:12]}"
        written = f"written by {request.written_by} at {request.written_utc}"
        does = "notes a change of" if request.changed else "ticks"
        await self._record(request, f"{does} the checklist of {request.profile}: {text}, {written}")

    async def _start_auto(self, request: requests.StartAuto) -> None:
        session = self._link.need_session()
        _refuse_while(session.transfers.is_busy)
        await self._record(request, f"start mission {request.digest[:12]} at item {request.from_item}")
        _refuse_while(session.transfers.is_busy)
        await session.pilot.start_auto(request)

    async def _start_guided(self, request: requests.StartGuided) -> None:
        session = self._link.need_session()
        _refuse_while(session.transfers.is_busy)
        await self._record(request, f"fly {len(request.targets)} targets in GUIDED")
        _refuse_while(session.transfers.is_busy)
        await session.pilot.start_guided(request)

    async def _fly_way(self, request: requests.FlyWay) -> None:
        pilot, last = self._link.need_session().pilot, request.targets[-1:]
        to = "".join(f" to {t.lat_deg:.7f}, {t.lon_deg:.7f}, {t.alt_rel_home_m:.1f} m above home" for t in last)
        then = ", then land" if request.end == "land" else ""
        await self._record(request, f"fly a certified way of {len(request.targets)} places{to}{then}")
        await pilot.fly_way(request)

    async def _set_speed(self, request: requests.SetSpeed) -> None:
        pilot = self._link.need_session().pilot
        await self._record(request, f"change the speed to {request.speed_m_s:g} m/s")
        await pilot.set_speed(request)

    async def _set_home(self, request: requests.SetHome) -> None:
        session = self._link.need_session()
        at = f"{request.lat_deg:.7f}, {request.lon_deg:.7f}, {request.alt_amsl_m:.1f} m above the sea"
        await self._record(request, f"set home to {at}")
        await session.set_home(request)

    async def _fly_manoeuvre(self, request: requests.FlyManoeuvre) -> None:
        pilot = self._link.need_session().pilot
        pilot.check_manoeuvre(request)
        what = "past a moving object" if request.kind == "sidestep" else f"{request.kind} an obstacle"
        await self._record(request, f"fly {what}, {len(request.targets)} places")
        await pilot.fly_manoeuvre(request)

    async def _may_fly_manoeuvre(self, request: requests.MayFlyManoeuvre) -> str:
        try:
            self._link.need_session().pilot.check_manoeuvre(request)
        except NotAllowedError as error:
            return f"{error.what} {error.advice}".strip()
        return ""

    async def _fly_rest(self, request: requests.FlyRest) -> None:
        pilot = self._link.need_session().pilot
        await self._record(request, f"fly the rest at its proper height, {len(request.targets)} places")
        pilot.fly_rest(request)

    async def _set_avoidance(self, request: requests.SetAvoidance) -> None:
        pilot = self._link.need_session(live=request.enabled).pilot
        if request.enabled:
            await pilot.avoidance.check_may_be_enabled(consent=request.consent)
            by = "" if request.by == "climb" else f" by {request.by}"
            await self._record(request, f"avoidance on{by}{', with consent' if request.consent else ''}")
            pilot.avoidance.enable(request.by)
        else:
            await self._record(request, "avoidance off", must=False)
            pilot.avoidance.disable()

    async def _record(self, request: Any, words: str, *, must: bool = True) -> None:
        await self._link.commands.record(request.operator, words, must=must)
        self._written[id(request)] = words


_HOLDING = {False: "", True: " while it holds in flight"}


def _refuse_in_mission(pilot: Pilot, request: requests.Upload | requests.UploadPlaces) -> None:
    if request.while_holding:
        pilot.check_holds()
    elif pilot.flies_mission:
        what = "A mission is being flown: replacing it would send the vehicle somewhere else."
        raise NotAllowedError(what, advice="Land first.")


def _refuse_armed(state: VehicleState, even_armed: bool) -> None:
    if even_armed or (state.heartbeat_t_mono_s is not None and not state.armed):
        return
    what = "The vehicle is armed." if state.armed else "Whether the vehicle is armed is not known."
    advice = "Land and disarm it, or ask for writing even while it is armed."
    raise NotAllowedError(f"{what} Parameters change how it flies at once.", advice=advice)


def _refuse_while(busy: bool) -> None:
    if busy:
        raise NotAllowedError("A mission is being transferred.", advice="Wait until it is over.")
