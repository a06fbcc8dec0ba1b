"""One session with a board at its port: known for what it is, set up, then asked for one frame after the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import serial

from mapping.radar.radar_params import FmcwParams
from telemetry.errors import SensorError
from telemetry.sensors.position2go import answers
from telemetry.sensors.position2go.answers import Frame, WrongAnswerError, frame_of, params_of
from telemetry.sensors.position2go.board_messages import Message, MessageStream, OutOfStepError, Payload, Status, encode
from telemetry.sensors.serial_port import failing_as_sensor

EVERY_S = 1 / 15
"""Wessendorp 2021 flew with 15 frames a second."""
ANSWER_WITHIN_S = 1.0
QUIET_S, LOUD_S = 0.05, 2.0
"""After a wrong byte: so long without another, and the line is free; no longer than that is waited for it."""
LOST_MOST = 5
"""So many frames in a row that did not come as they should: the board has to be set up anew."""
_CHUNK_BYTES = 4096


class _LostAnswerError(Exception):
    """Nothing that could be understood came in answer to one request."""


@dataclass(slots=True)
class Position2GoCounts:
    """Since the agent began."""

    frames: int = 0
    bytes: int = 0
    bad_bytes: int = 0
    """Of no message that could be read."""
    lost_frames: int = 0
    """Asked for, and not come as they should: cut short, damaged, late."""
    clipped_frames: int = 0


@dataclass(frozen=True, slots=True)
class TakenFrame:
    """A frame, when its middle was (on the clock that was given), and how many before it were lost."""

    t_s: float
    frame: Frame
    lost_before: int


class BoardSession:
    """At an open port. All raise SensorError: another device, refused, silent, or the port has gone."""

    def __init__(
        self,
        port: serial.Serial,
        counts: Position2GoCounts,
        *,
        now: Callable[[], float] = time.monotonic,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        self._port, self._counts, self._now, self._wait = port, counts, now, wait
        self._device = str(port.port)
        self._stream = MessageStream()

    def set_up(self) -> FmcwParams:
        """Stops its timer, sets the frames' format, and reads back what it sends."""
        self._until_quiet()
        try:
            known = answers.endpoints(self._ask(0, answers.LIST_ENDPOINTS))
        except (_LostAnswerError, WrongAnswerError) as error:
            raise self._other("Nothing at this port answers as a Position2Go does.") from error
        if answers.BASE not in known or answers.SWEEP not in known:
            raise self._other(
                "This is another of Infineon's boards, or it has other firmware: it takes no FMCW frames."
            )
        self._base, self._sweep = known[answers.BASE], known[answers.SWEEP]
        try:
            self._ask(self._base, answers.STOP)
            self._ask(self._base, answers.SET_FORMAT)
            answers.check_format(self._ask(self._base, answers.GET_FORMAT))
            chirp = self._ask(self._base, answers.GET_CHIRP)
            return params_of(self._ask(self._sweep, answers.GET_SWEEP), chirp)
        except _LostAnswerError as error:
            raise SensorError(
                "The radar stopped answering while it was set up.", where=self._device, advice="Switch it off and on."
            ) from error
        except WrongAnswerError as error:
            raise self._other(f"The radar answers otherwise than a Position2Go. {error}") from error

    def frames(self, middle_s: float) -> Iterator[TakenFrame]:
        """For ever, ``EVERY_S`` apart; a frame's middle is ``middle_s`` after it was asked for."""
        lost = 0
        while True:
            asked_s = self._now()
            try:
                frame = frame_of(self._ask(self._base, answers.TAKE_FRAME))
            except (_LostAnswerError, WrongAnswerError):
                lost += 1
                self._counts.lost_frames += 1
                if lost >= LOST_MOST:
                    raise SensorError(
                        f"{lost} frames in a row did not come from the radar as they should.",
                        where=self._device,
                        advice="Check its cable and power.",
                    ) from None
                continue
            self._counts.frames += 1
            yield TakenFrame(asked_s + middle_s, frame, lost)
            lost = 0
            self._wait(max(0.0, asked_s + EVERY_S - self._now()))

    def _ask(self, endpoint: int, request: bytes) -> bytes:
        """The answer's payload; empty where a status alone is the answer."""
        with failing_as_sensor(self._device):
            self._port.write(encode(endpoint, request))
        answer, until_s = b"", self._now() + ANSWER_WITHIN_S
        while self._now() < until_s:
            for message in self._heard():
                match message:
                    case Payload(source, data) if source == endpoint:
                        answer = data
                    case Status(source, 0) if source == endpoint:
                        return answer
                    case Status(_, code) if code:
                        raise SensorError(
                            f"The radar refused request 0x{request[0]:02x} with status {code}.",
                            where=self._device,
                            advice="Switch it off and on, and let no other program use it.",
                        )
                    case _:
                        continue
        self._until_quiet()
        raise _LostAnswerError

    def _heard(self) -> list[Message]:
        data = self._read()
        try:
            return self._stream.feed(data)
        except OutOfStepError:
            self._until_quiet()
            raise _LostAnswerError from None

    def _until_quiet(self) -> None:
        """The board speaks only when it is asked: behind a pause there is a message's beginning again."""
        self._counts.bad_bytes += self._stream.reset()
        end_s = self._now() + LOUD_S
        timeout, self._port.timeout = self._port.timeout, QUIET_S
        try:
            while (data := self._read()) and self._now() < end_s:
                self._counts.bad_bytes += len(data)
        finally:
            self._port.timeout = timeout

    def _read(self) -> bytes:
        with failing_as_sensor(self._device):
            data = self._port.read(min(_CHUNK_BYTES, max(1, self._port.in_waiting)))
        self._counts.bytes += len(data)
        return data

    def _other(self, what: str) -> SensorError:
        return SensorError(
            what, where=self._device, advice="Check that this is its port: often /dev/serial/by-id/*IFX_CDC*."
        )
