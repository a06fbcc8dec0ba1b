"""The guardian, with servers of a few lines: what dies or hangs is started again, what never came up is not."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from server.work import guardian
from server.work.guardian import CHANNEL, LINK_OPEN, LINK_USED, PAUSES_S, Guardian
from telemetry.bus.liveness import HUNG_S

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 90.0
SERVER = f"""
import json, os, signal, socket, sys, time

print("loaded", os.getpid(), flush=True)
channel = socket.socket(fileno=int(os.environ["{CHANNEL}"]))
line = channel.makefile("rb").readline()
if not line:
    sys.exit(0)
told = json.loads(line)
print("server", os.getpid(), told["link"], told["silent_since_t_mono_s"] is not None, flush=True)
what = sys.argv[1]
if what == "refuse" or (what == "once" and told["silent_since_t_mono_s"]):
    sys.exit(2)
if what == "stuck":
    signal.pause()
if what == "saves":
    def save(*_):
        os.write(1, b"saved\\n")  # print may be in the midst of a line
        sys.exit(5)
    signal.signal(signal.SIGTERM, save)
    signal.signal(signal.SIGINT, save)
if what == "slow" and told["silent_since_t_mono_s"]:
    time.sleep({HUNG_S + 2})
proved = False
while True:
    channel.send({LINK_USED!r} if what == "used" else {LINK_OPEN!r})
    if not proved:
        print("proved", flush=True)
        proved = True
    if what == "hangs" and not told["silent_since_t_mono_s"]:
        signal.pause()
    time.sleep(0.2)
"""


class Guarded:
    """A guardian's process, and the lines of its servers."""

    def __init__(self, what: str, spare_after_s: float = 1000.0) -> None:
        main = f"from server.work import guardian; guardian.SPARE_AFTER_S = {spare_after_s}; guardian.main()"
        command = [sys.executable, "-c", main, sys.executable, "-c", SERVER, what]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT, start_new_session=True
        )
        self.lines: list[str] = []
        self.log: list[str] = []
        streams = ((self.process.stdout, self.lines), (self.process.stderr, self.log))
        self._readers = [threading.Thread(target=_read, args=each) for each in streams]
        for reader in self._readers:
            reader.start()

    def server(self, number: int) -> list[str]:
        """Process id, link and whether it was told of a silence, of the so manieth server."""
        wait(lambda: len(self._servers()) >= number)
        return self._servers()[number - 1].split()[1:]

    def pid(self, number: int) -> int:
        return int(self.server(number)[0])

    def loaded(self) -> list[int]:
        """Process ids of all servers that were started, spare ones as well."""
        return [int(line.split()[1]) for line in self.lines if line.startswith("loaded")]

    def _servers(self) -> list[str]:
        return [line for line in self.lines if line.startswith("server")]

    def ended(self) -> int:
        code = self.process.wait(PATIENCE_S)
        for reader in self._readers:
            reader.join(PATIENCE_S)
        return code

    def words(self) -> str:
        return "".join(self.log)

    def close(self) -> None:
        """Whatever is left of it."""
        for pid in self.loaded():
            if _is_there(pid):
                os.kill(pid, signal.SIGKILL)
        self.process.kill()
        self.ended()
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()


def _read(stream: object, into: list[str]) -> None:
    into.extend(iter(stream.readline, ""))  # type: ignore[attr-defined]


def _is_there(pid: int) -> bool:
    try:
        return CHANNEL.encode() in Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return False


def wait(condition: object) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def guarded() -> Iterator[object]:
    made: list[Guarded] = []
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # whoever runs the tests may have it ignored

    def make(what: str, **options: float) -> Guarded:
        made.append(Guarded(what, **options))
        return made[-1]

    yield make
    signal.signal(signal.SIGHUP, before)
    for each in made:
        each.close()


def test_a_killed_server_is_started_again_with_the_link_that_nobody_has_used(guarded) -> None:
    station = guarded("works")
    first = station.server(1)
    assert re.fullmatch(r"[\w-]{40,}", first[1])
    assert first[2] == "False"
    answered(station)
    os.kill(int(first[0]), signal.SIGKILL)
    second = station.server(2)
    assert second[0] != first[0]
    assert second[1:] == [first[1], "True"]
    wait(lambda: "The server ended by SIGKILL. It is started again now; restart 1 " in station.words())


def test_a_spare_server_waits_with_its_modules_loaded_and_takes_over(guarded) -> None:
    station = guarded("works", spare_after_s=0.3)
    answered(station)
    wait(lambda: len(station.loaded()) == 2)
    first, spare = station.loaded()
    assert len(station._servers()) == 1
    os.kill(first, signal.SIGKILL)
    assert station.pid(2) == spare
    assert station.server(2)[2] == "True"
    answered(station, times=2)
    wait(lambda: len(station.loaded()) == 3)
    station.process.send_signal(signal.SIGTERM)
    assert station.ended() == -signal.SIGTERM
    wait(lambda: not _is_there(station.loaded()[2]))


def test_a_spare_server_that_ends_costs_nothing(guarded) -> None:
    station = guarded("works", spare_after_s=0.3)
    answered(station)
    wait(lambda: len(station.loaded()) == 2)
    os.kill(station.loaded()[1], signal.SIGKILL)
    wait(lambda: not _is_there(station.loaded()[1]))
    os.kill(station.pid(1), signal.SIGKILL)
    assert station.pid(2) == station.loaded()[2]
    answered(station, times=2)
    wait(lambda: "It is started again now; restart 1 " in station.words())
    assert "restart 2 " not in station.words()


def test_nobody_is_left_of_a_guardian_that_is_killed(guarded) -> None:
    station = guarded("works", spare_after_s=0.3)
    answered(station)
    wait(lambda: len(station.loaded()) == 2)
    station.process.kill()
    wait(lambda: not _is_there(station.loaded()[1]))


def test_a_used_link_is_not_given_to_the_next_server(guarded) -> None:
    station = guarded("used")
    answered(station)
    os.kill(station.pid(1), signal.SIGKILL)
    assert station.server(2)[1:] == ["None", "True"]


@pytest.mark.parametrize("how", ["stopped", "waits for ever"])
def test_a_hung_server_is_ended_and_started_again(guarded, how: str) -> None:
    station = guarded("works" if how == "stopped" else "hangs")
    answered(station)
    if how == "stopped":
        os.kill(station.pid(1), signal.SIGSTOP)
    station.server(2)
    assert not _is_there(station.pid(1))
    wait(lambda: re.search(r"The server did not answer for ([3-9]|\d{2,}) s and is ended", station.words()))


def test_one_that_is_only_slow_to_start_again_is_waited_for(guarded) -> None:
    station = guarded("slow")
    answered(station)
    os.kill(station.pid(1), signal.SIGKILL)
    answered(station, times=2)
    assert len(station._servers()) == 2


def test_as_a_background_job_of_a_script_it_heeds_an_interrupt(guarded) -> None:
    """A shell starts those with SIGINT ignored."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        station = guarded("saves")
    finally:
        signal.signal(signal.SIGINT, before)
    answered(station)
    station.process.send_signal(signal.SIGINT)
    assert station.ended() == 5


def test_killed_before_it_came_up_it_is_not_started_again(guarded) -> None:
    station = guarded("stuck")
    os.kill(station.pid(1), signal.SIGKILL)
    assert station.ended() == -signal.SIGKILL
    assert len(station._servers()) == 1


def test_what_never_came_up_is_not_started_again(guarded) -> None:
    station = guarded("refuse")
    assert station.ended() == 2
    assert len(station._servers()) == 1
    assert station.words() == ""


def test_a_server_that_came_up_once_is_tried_again_and_again_but_ever_more_slowly(guarded) -> None:
    station = guarded("once")
    answered(station)
    os.kill(station.pid(1), signal.SIGKILL)
    # Longer than a busy machine holds up who ends it meanwhile.
    wait(lambda: "ended with code 2. It is started again in 5 s; restart 4 " in station.words())
    assert "ended with code 2. It is started again in 1 s; restart 2 " in station.words()
    station.process.send_signal(signal.SIGTERM)
    assert station.ended() == 0


@pytest.mark.parametrize(("number", "what", "code"), [
    (signal.SIGTERM, "works", -signal.SIGTERM), (signal.SIGTERM, "saves", 5), (signal.SIGHUP, "saves", 5),
    (signal.SIGINT, "works", -signal.SIGINT),
])  # fmt: skip
def test_asked_to_end_it_lets_the_server_end_first_and_says_how(
    guarded, number: signal.Signals, what: str, code: int
) -> None:
    station = guarded(what)
    answered(station)
    station.process.send_signal(number)
    assert station.ended() == code
    assert ("saved\n" in station.lines) == (what == "saves")
    assert len(station._servers()) == 1
    assert "started again" not in station.words()


def test_it_is_small(guarded) -> None:
    heavy = "{'numpy', 'asyncio', 'subprocess', 'pydantic', 'fastapi', 'logging'}"
    code = f"import sys, {guardian.__name__}; print(*sorted({heavy} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert loaded.strip() == ""


def test_pauses_grow_and_end_somewhere() -> None:
    assert PAUSES_S[0] == 0.0
    assert list(PAUSES_S) == sorted(PAUSES_S)
    made = Guardian([])
    assert made._link
    assert made._link != Guardian([])._link


def answered(station: Guarded, times: int = 1) -> None:
    """So many servers of it have proved that they work."""
    wait(lambda: station.lines.count("proved\n") == times)
