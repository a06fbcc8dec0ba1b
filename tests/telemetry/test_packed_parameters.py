"""ArduPilot's file of all its parameters: decoded as MAVProxy decodes it, read whole over lossy links, and bounded."""

from __future__ import annotations

import contextlib
import importlib.util
import random
import string
import struct
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import RefusedError, TransferError
from telemetry.mavlink.logs.ftp.payload import MOST_DATA, NUMBERS, FtpPayload, Nak, Opcode, read_payload
from telemetry.mavlink.logs.ftp.questions import Numbers
from telemetry.mavlink.logs.ftp.whole import FtpReadWhole
from telemetry.mavlink.parameters.packed import MOST_BYTES, PATH, read_packed
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS, Kind, Parameters, Spec
from telemetry.simulation.simulator.own_logs.keeping import OwnLogs
from telemetry.simulation.simulator.protocol.file_protocol import FileProtocol
from telemetry.simulation.simulator.protocol.made_files import MadeFile, ardupilot_file, packed
from telemetry.topics.parameters import Parameter
from tests.telemetry.file_vehicles import FOLDER, FileVehicle
from tests.telemetry.lossy import STATION, VEHICLE, Codec, Faults, Run

LOSSY = Faults(loss=0.3, reordering=0.1, duplicates=0.05, corruption=0.01)
TYPES: dict[Kind, int] = {"int8": 2, "int16": 4, "int32": 6, "float": 9}
LOW_HIGH = {"int8": 2**7, "int16": 2**15, "int32": 2**31}
NAMES = st.text(string.ascii_uppercase + string.digits + "_", min_size=1, max_size=16)


@st.composite
def tables(draw: st.DrawFn) -> Parameters:
    """Names that share beginnings, all types, some values that are not the default."""
    specs: dict[str, Spec] = {}
    for name in draw(st.lists(NAMES, min_size=1, max_size=60, unique=True)):
        kind = draw(st.sampled_from(list(TYPES)))
        numbers = st.floats(width=32, allow_nan=False, allow_infinity=False)
        whole = st.integers(-LOW_HIGH.get(kind, 1), LOW_HIGH.get(kind, 1) - 1)
        specs[name] = Spec(kind, draw(numbers if kind == "float" else whole))
    return Parameters(specs, **{name: 1.0 for name in specs if draw(st.booleans())})


def expected(parameters: Parameters, *, defaults: bool) -> tuple[Parameter, ...]:
    return tuple(
        Parameter(name, parameters[name], TYPES[spec.kind], spec.default if defaults else None)
        for name, spec in parameters.specs.items()
    )


@given(tables(), st.booleans())
def test_every_value_and_default_comes_back(parameters: Parameters, defaults: bool) -> None:
    assert read_packed(packed(parameters, with_defaults=defaults)) == expected(parameters, defaults=defaults)


@given(tables(), st.booleans())
def test_mavproxy_decodes_the_same(parameters: Parameters, defaults: bool) -> None:
    if importlib.util.find_spec("MAVProxy") is None:
        pytest.skip("MAVProxy is not installed: pip install --no-deps -r requirements-peers.txt")
    from MAVProxy.modules.lib.param_ftp import ftp_param_decode

    content = packed(parameters, with_defaults=defaults)
    theirs: Any = ftp_param_decode(content)
    ours = read_packed(content)
    assert [(name.decode(), float(value)) for name, value, _ in theirs.params] == [(p.name, p.value) for p in ours]
    if defaults:
        assert [float(value) for _, value, _ in theirs.defaults] == [p.default for p in ours]


@given(st.data())
def test_a_file_that_is_cut_anywhere_is_refused(data: st.DataObject) -> None:
    content = packed(Parameters(RTL_ALT=4000.0), with_defaults=True)
    with pytest.raises(TransferError, match="file of parameters"):
        read_packed(content[: data.draw(st.integers(0, len(content) - 1))])


@given(st.binary(max_size=300), st.sampled_from([0x671B, 0x671C]), st.integers(0, 40))
def test_whatever_comes_is_a_list_or_refused(noise: bytes, magic: int, count: int) -> None:
    found: tuple[Parameter, ...] | None = None
    with contextlib.suppress(TransferError):
        found = read_packed(struct.pack("<HHH", magic, count, count) + noise)
    assert found is None or len({p.name for p in found}) == len(found) == count


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "ends within its header"),
        (struct.pack("<HHH", 0x4711, 1, 1), "begins with 0x4711"),
        (struct.pack("<HHH", 0x671B, 1, 2), "1 of 2 parameters"),
        (struct.pack("<HHH", 0x671B, 1, 1) + b"\x05\x00A\x00", "type 5"),
        (struct.pack("<HHH", 0x671B, 1, 1) + b"\x01\x01A\x01", "no name of a parameter"),
        (struct.pack("<HHH", 0x671B, 2, 2) + 2 * b"\x01\x00A\x01", "a parameter twice"),
        (struct.pack("<HHH", 0x671B, 2, 2) + b"\x01\x00A\x01", "has 1 parameters and says 2"),
    ],
)
def test_what_makes_no_sense_is_named(content: bytes, says: str) -> None:
    with pytest.raises(TransferError, match=says):
        read_packed(content)


def test_what_is_no_number_is_none() -> None:
    content = struct.pack("<HHH", 0x671B, 1, 1) + b"\x04\x00A" + struct.pack("<f", float("nan"))
    assert read_packed(content) == (Parameter("A", None, 9),)


class MakesFiles(FileVehicle):
    """Says that its file is so large when it is opened."""

    def __init__(self, content: bytes, said: int) -> None:
        self.files = FileProtocol(
            cast(OwnLogs, SimpleNamespace(files={}, writer=SimpleNamespace(folder=FOLDER))),
            most_sessions=4,
            made=lambda path: MadeFile(content, said) if path == "/@f" else None,
        )


def reader(path: str = "@f", most_bytes: int = MOST_BYTES) -> FtpReadWhole:
    return FtpReadWhole(path, most_bytes=most_bytes, target=VEHICLE, numbers=Numbers())


def sizes_of_reads(run: Run) -> set[int]:
    payloads: list[Any] = [read_payload(message) for _, way, message in run.log if way == "up"]
    return {each.size for each in payloads if each.opcode in (Opcode.READ_FILE, Opcode.BURST_READ_FILE)}


@pytest.mark.parametrize("size", [1, 238, 239, 240, 478, 5000, 50_000])
@pytest.mark.parametrize("said", [0, 300, 1 << 20])
def test_a_file_is_read_to_its_end_whatever_size_was_said(size: int, said: int) -> None:
    content = random.Random(size).randbytes(size)
    run = Run(reader(), MakesFiles(content, said)).until_end()
    assert run.result == content
    assert sizes_of_reads(run) == {MOST_DATA}, "ArduPilot refuses reads of another size than the first"


class Sparing(MakesFiles):
    """Sends less at once than it is asked for; like ArduPilot, it refuses another size of read than the first."""

    def __init__(self, content: bytes, *, most: int, bursts: bool) -> None:
        super().__init__(content, 3000)
        self._most, self._bursts = most, bursts
        self._sizes: set[int] = set()

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        asked = read_payload(message) if message.get_type() == "FILE_TRANSFER_PROTOCOL" else None
        if asked is None or asked.opcode not in (Opcode.READ_FILE, Opcode.BURST_READ_FILE):
            return super().on_message(message, now_s)
        self._sizes.add(asked.size)
        refused = len(self._sizes) > 1 or (asked.opcode == Opcode.BURST_READ_FILE and not self._bursts)
        if refused:
            data, seq = bytes((Nak.FAIL,)), (asked.seq + 1) % NUMBERS
            return [FtpPayload(seq, Opcode.NAK, asked.session, 0, 1, data, asked.opcode).message(STATION)]
        fewer = FtpPayload(asked.seq, asked.opcode, asked.session, asked.offset, self._most)
        own = fewer.message((message.target_system, message.target_component))
        return super().on_message(Codec(VEHICLE).parse(Codec(STATION).pack(own)), now_s)


@pytest.mark.parametrize("most", [70, 128, 238])
@pytest.mark.parametrize("bursts", [True, False])
@pytest.mark.parametrize("faults", [Faults(), LOSSY])
def test_blocks_that_are_not_full_are_not_the_end(most: int, bursts: bool, faults: Faults) -> None:
    content = random.Random(most).randbytes(5000)
    run = Run(reader(), Sparing(content, most=most, bursts=bursts), faults, 3).until_end()
    assert run.result == content


def test_the_simulated_vehicle_refuses_a_read_beyond_the_end_at_offset_0_as_ardupilot_does() -> None:
    run = Run(reader(), MakesFiles(bytes(500), 3000)).until_end()
    heard: list[Any] = [read_payload(message) for _, way, message in run.log if way == "down"]
    refused = [each for each in heard if each.opcode == Opcode.NAK and each.answers == Opcode.READ_FILE]
    assert refused
    assert {each.offset for each in refused} == {0}
    assert run.result == bytes(500)


@pytest.mark.parametrize("size", [239 * 40, 9_999])
def test_fifty_of_fifty_files_are_exact_over_a_link_that_loses_a_third(size: int) -> None:
    for seed in range(50):
        content = random.Random(seed).randbytes(size)
        run = Run(reader(), MakesFiles(content, 3000), LOSSY, seed).until_end()
        assert run.result == content, seed
        assert sizes_of_reads(run) == {MOST_DATA}
        assert run.now_s < 60.0


def test_a_file_without_end_is_not_kept_and_one_that_is_not_there_is_refused() -> None:
    error = Run(reader(most_bytes=10_000), MakesFiles(bytes(40_000), 3000)).until_end().error
    assert isinstance(error, TransferError)
    assert "larger than 10000 bytes" in error.what
    assert isinstance(Run(reader("@g"), MakesFiles(b"1", 1)).until_end().error, RefusedError)


def test_the_simulated_vehicle_makes_the_file_that_is_asked_for() -> None:
    parameters = Parameters(RTL_ALT=4000.0)
    made = ardupilot_file(parameters, f"/{PATH}")
    assert made is not None
    found = {p.name: p for p in read_packed(made.content)}
    assert found.keys() == SPECS.keys()
    assert (found["RTL_ALT"].value, found["RTL_ALT"].default) == (4000.0, 1500.0)
    assert ardupilot_file(parameters, "/@PARAM/other.pck") is None
