"""The parameters of a vehicle behind a link that answers as one does: read, judged on the plan, written, as files."""

from __future__ import annotations

import asyncio
import gzip
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from planning.errors import FormatError
from server.errors import NotReadyError, StorageFullError
from server.flying import descriptions
from server.flying.descriptions import MOST_KEPT, known_crcs
from server.flying.parameter_desk import ParameterDesk
from server.schemas.parameter_docs import FindingDoc, ParameterChangeDoc, ParametersDoc
from telemetry.errors import NotAllowedError, NoVehicleError, RefusedError
from telemetry.topics.parameters import Parameter, ParameterList, ParameterWritten, VehicleMetadata
from telemetry.topics.requests import ListParameters, Operator, ReadMetadata, WriteParameters
from telemetry.topics.vehicle import VehicleState

ME = Operator("Anna", 7)
QUAD = VehicleState(1, 1, autopilot="ardupilot", vehicle_type=2, firmware_version="4.6.0")
PDEF = b"""<paramfile><parameters><param humanName="Return altitude" name="ArduCopter:RTL_ALT" documentation="Height.">
<field name="Range">30 300000</field><field name="Units">cm</field></param></parameters></paramfile>"""


class Link:
    """Holds values as a vehicle does: one it limits, and none while it is armed."""

    def __init__(self) -> None:
        self.held = {"FS_GCS_ENABLE": 0.0, "RTL_ALT": 1500.0, "WPNAV_SPEED": 500.0}
        self.armed = False
        self.own: VehicleMetadata | None = None
        self.asked: list[Any] = []

    async def call(self, request: Any) -> Any:
        self.asked.append(request)
        if isinstance(request, ListParameters):
            kinds = {"FS_GCS_ENABLE": 2}
            return ParameterList(tuple(Parameter(n, v, kinds.get(n, 9)) for n, v in self.held.items()))
        if isinstance(request, ReadMetadata):
            if self.own is None:
                raise RefusedError("The vehicle has no description of itself.", advice="")
            return self.own if self.own.crc not in request.known_crcs else VehicleMetadata(self.own.crc, b"")
        assert isinstance(request, WriteParameters)
        assert not request.even_armed
        if self.armed:
            raise NotAllowedError("The vehicle is armed.", advice="Land and disarm it.")
        return tuple(self._set(change.name, change.value) for change in request.changes)

    def _set(self, name: str, value: float) -> ParameterWritten:
        before, now = self.held.get(name), min(value, 2000.0)
        if before is None:
            return ParameterWritten(name, value, None, None, "refused", "The vehicle has no such parameter.")
        self.held[name] = now
        return ParameterWritten(name, value, before, now, "set" if now == value else "adjusted")


class Bench:
    def __init__(self, root: Path, state: VehicleState | None = QUAD, name: str = "") -> None:
        self.link = Link()
        self.aboard: Any = SimpleNamespace(vehicle="udp/1/1" if state else None, record=None)
        link: Any = self.link
        live: Any = SimpleNamespace(state=state)
        self.told_written = 0
        self.desk = ParameterDesk(link, live, self.aboard, root, self._on_written, name)

    def _on_written(self) -> None:
        self.told_written += 1


def run(play: Any) -> Any:
    return asyncio.run(play)


def finding(doc: ParametersDoc, name: str) -> FindingDoc:
    return next(found for found in doc.findings if found.parameter == name)


def test_before_a_low_flight_each_setting_says_what_it_does_and_is_set_so(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        doc = await bench.desk.read()
        assert doc.vehicle == "vehicle 1, ardupilot 4.6.0"
        assert [p.name for p in doc.parameters] == sorted(bench.link.held)
        wrong = finding(doc, "FS_GCS_ENABLE")
        assert wrong.state != "good"
        assert wrong.better is not None
        change = ParameterChangeDoc(name="FS_GCS_ENABLE", value=wrong.better)
        answer = await bench.desk.write(ME, [change])
        assert [(w.outcome, w.took) for w in answer.written] == [("set", True)]
        assert finding(answer.now, "FS_GCS_ENABLE").state == "good"
        assert (await bench.desk.doc()) == answer.now
        assert bench.told_written == 1, "nothing was sent"

    run(play())


def test_what_the_vehicle_made_of_a_value_is_what_is_shown(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        await bench.desk.read()
        changes = [ParameterChangeDoc(name="RTL_ALT", value=9000.0), ParameterChangeDoc(name="NO_SUCH", value=1.0)]
        answer = await bench.desk.write(ME, changes)
        assert [(w.outcome, w.after) for w in answer.written] == [("adjusted", 2000.0), ("refused", None)]
        assert bench.told_written == 1
        assert {p.name: p.value for p in answer.now.parameters}["RTL_ALT"] == 2000.0
        bench.link.armed = True
        with pytest.raises(NotAllowedError):
            await bench.desk.write(ME, [ParameterChangeDoc(name="RTL_ALT", value=1600.0)])
        assert (await bench.desk.doc()) == answer.now

    run(play())


def test_nothing_is_shown_of_another_vehicle_than_the_one_that_was_read(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        with pytest.raises(NotReadyError, match="have not been read"):
            await bench.desk.doc()
        await bench.desk.read()
        bench.aboard.vehicle = "udp/2/1"
        with pytest.raises(NotReadyError):
            await bench.desk.doc()
        with pytest.raises(NotReadyError):
            await bench.desk.write(ME, [ParameterChangeDoc(name="RTL_ALT", value=1600.0)])
        with pytest.raises(NoVehicleError):
            await Bench(tmp_path, None).desk.read()

    run(play())


def test_one_of_several_is_called_by_its_name_because_their_systems_may_have_the_same_number(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path, name="Wasp")
        assert (await bench.desk.read()).vehicle == "Wasp (system 1), ardupilot 4.6.0"
        assert "Wasp (system 1)" in bench.desk.saved("vehicle.param")

    run(play())


def test_a_plane_is_not_judged_by_rules_for_copters(tmp_path: Path) -> None:
    async def play() -> None:
        doc = await Bench(tmp_path, replace(QUAD, vehicle_type=1)).desk.read()
        assert doc.findings == []
        assert "multirotors" in doc.not_judged

    run(play())


def test_the_makers_file_is_kept_for_the_next_time(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        assert not (await bench.desk.read()).described
        with pytest.raises(FormatError):
            await bench.desk.describe("apm.pdef.xml", b"<nothing/>")
        doc = await bench.desk.describe("apm.pdef.xml", PDEF)
        rtl = next(p for p in doc.parameters if p.name == "RTL_ALT")
        assert (rtl.unit, rtl.title, rtl.low, rtl.high) == ("cm", "Return altitude", 30.0, 300000.0)
        assert (await Bench(tmp_path).desk.read()).described

    run(play())


@pytest.mark.parametrize("file", ["vehicle.param", "vehicle.params"])
def test_what_was_saved_compares_as_equal_and_a_change_is_found(tmp_path: Path, file: Any) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        await bench.desk.read()
        data = bench.desk.saved(file).encode()
        assert (await bench.desk.compared(file, data)).differences == []
        bench.link.held["RTL_ALT"] = 1800.0
        await bench.desk.read()
        (difference,) = (await bench.desk.compared(file, data)).differences
        assert (difference.name, difference.here, difference.there) == ("RTL_ALT", 1800.0, 1500.0)

    run(play())


def test_two_vehicles_are_compared_as_they_are_now(tmp_path: Path) -> None:
    async def play() -> None:
        bee, wasp = Bench(tmp_path, name="Bee"), Bench(tmp_path, name="Wasp")
        with pytest.raises(NotReadyError):
            await bee.desk.compared_with(wasp.desk)
        await bee.desk.read()
        await wasp.desk.read()
        wasp.link.held |= {"RTL_ALT": 1800.0, "COMPASS_OFS_X": 12.0, "MAV_SYSID": 2.0, "STAT_BOOTCNT": 9.0}
        bee.link.held["MAV_SYSID"] = 1.0
        await bee.desk.read()
        made = await bee.desk.compared_with(wasp.desk)
        assert (made.file, made.is_vehicle, made.same, made.notes) == ("Wasp (system 1), ardupilot 4.6.0", True, 2, [])
        assert [(d.name, d.here, d.there, d.own) for d in made.differences] == [
            ("MAV_SYSID", 1.0, 2.0, True),
            ("RTL_ALT", 1500.0, 1800.0, False),
            ("COMPASS_OFS_X", None, 12.0, True),
        ]
        assert not any(isinstance(asked, WriteParameters) for asked in (*bee.link.asked, *wasp.link.asked))

    run(play())


def test_vehicles_with_other_firmware_are_compared_with_a_word_of_caution(tmp_path: Path) -> None:
    async def play() -> None:
        bee, wasp = Bench(tmp_path), Bench(tmp_path, replace(QUAD, firmware_version="4.7.0"))
        await bee.desk.read()
        (note,) = (await bee.desk.compared_with(wasp.desk)).notes
        assert "different firmware" in note

    run(play())


def own(crc: int, words: str) -> VehicleMetadata:
    entry = {"name": "RTL_ALT", "shortDesc": words, "units": "m", "default": 1500}
    return VehicleMetadata(crc, gzip.compress(json.dumps({"parameters": [entry]}).encode()))


def test_what_the_vehicle_says_of_itself_goes_before_the_makers_file_and_is_kept(tmp_path: Path) -> None:
    async def play() -> None:
        bench = Bench(tmp_path)
        await bench.desk.read()
        await bench.desk.describe("apm.pdef.xml", PDEF)
        bench.link.own = own(5, "Its own words")
        for _ in range(2):  # the second time it is found by its CRC
            rtl = next(p for p in (await bench.desk.read()).parameters if p.name == "RTL_ALT")
            assert (rtl.title, rtl.unit, rtl.changed) == ("Its own words", "m", False)
        assert bench.link.asked[-1].known_crcs == (5,)
        bench.link.own = VehicleMetadata(6, b"no description")
        rtl = next(p for p in (await bench.desk.read()).parameters if p.name == "RTL_ALT")
        assert rtl.title == "Return altitude"
        for crc in range(10, 10 + 2 * MOST_KEPT):
            bench.link.own = own(crc, "Other firmware")
            await bench.desk.read()
        assert len(known_crcs(tmp_path, "ardupilot")) == MOST_KEPT

    run(play())


def test_what_was_read_is_shown_even_if_the_vehicles_description_cannot_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(path: Path, data: bytes) -> None:
        raise StorageFullError("The disk is full.", where=path.name, advice="Free some space.")

    async def play() -> None:
        bench = Bench(tmp_path)
        bench.link.own = own(5, "Its own words")
        doc = await bench.desk.read()
        assert next(p.title for p in doc.parameters if p.name == "RTL_ALT") == "Its own words"
        assert await bench.desk.doc() == doc
        (said,) = [record for record in caplog.records if record.levelname == "WARNING"]
        assert "not kept" in said.message
        assert "The disk is full" in said.message

    monkeypatch.setattr(descriptions, "write_atomically", full)
    run(play())
    assert known_crcs(tmp_path, "ardupilot") == ()
