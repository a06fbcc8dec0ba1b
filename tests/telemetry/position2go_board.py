"""A Position2Go at a pseudo-terminal: answers as its firmware does, damages what it is told to, can be unplugged."""

from __future__ import annotations

import struct
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np

from mapping.radar.radar_params import POSITION2GO
from telemetry.simulation.simulator.sensors.iq_synthesis import Returns, sampled
from tests.mapping.radar.echoes import noise
from tests.telemetry.pseudo_terminals import PseudoTerminals, plugged_in

END = b"\xdb\xe0"
BITS = 12
ENDPOINTS = [(0x52424153, 1), (0x52503247, 1), (0x52464D43, 1)]
"""Numbered from 1: radar base, the board's own, FMCW."""


def payload(endpoint: int, data: bytes) -> bytes:
    return struct.pack("<BBH", 0x5A, endpoint, len(data)) + data + END


def status(endpoint: int, code: int = 0) -> bytes:
    return struct.pack("<BBH", 0x5B, endpoint, code)


def frame(number: int, *, range_m: float = 8.0, azimuth_deg: float = 20.0, gain: float = 12.0) -> bytes:
    """What the converters made of one echo in noise: chirps, receivers, I then Q, 12 bits packed from the lowest."""
    of = np.array([range_m]), np.array([-1.5]), np.radians([azimuth_deg]), np.zeros(1), np.array([6.0 + 0j])
    cube = gain * (sampled(POSITION2GO, Returns(*of)) + noise(POSITION2GO.shape, number))
    words = np.stack([cube.real, cube.imag], axis=2) + (1 << BITS - 1) + 90
    levels = np.clip(np.round(words), 0, (1 << BITS) - 1).astype(np.uint32).ravel()
    packed = np.packbits((levels[:, None] >> np.arange(BITS)) & 1, bitorder="little").tobytes()
    head = struct.pack("<BIIBIBBBB", 0, number, 16, 2, 64, 0b11, 1, BITS, 0)
    return head + packed


class Position2GoBoard(PseudoTerminals):
    """``device`` is the port's name; ``damage`` is what happens to the next answers, first one first."""

    def __init__(self, folder: Path) -> None:
        self.device = folder / "ttyACM0"
        super().__init__(self.device)
        self.endpoints = list(ENDPOINTS)
        self.sweep_khz, self.chirp_ns, self.direction = (24_025_000, 24_225_000), 300_000, 0
        self.format = struct.pack("<BIIBB", 0x41, 128, 1, 1, 2)
        self.refuses: dict[int, int] = {}
        """Command of the base endpoint -> status."""
        self.is_mute = False
        self.gain = 12.0
        self.damage: list[str] = []
        self.frames = 0
        self.interval_us = 100_000
        """Of its own timer: on, as some other program left it."""

    def plug(self) -> None:
        """The board has started anew."""
        self.frames = 0
        super().plug()

    def answered(self, heard: bytes) -> tuple[list[bytes], bytes]:
        answers = []
        while len(heard) >= 4 and len(heard) >= 6 + int.from_bytes(heard[2:4], "little"):
            size = int.from_bytes(heard[2:4], "little")
            request, heard = heard[: 6 + size], heard[6 + size :]
            assert request[0] == 0x5A
            assert request.endswith(END)
            answers.append(self._answer(request[1], request[4:-2]))
        return answers, heard

    def _answer(self, endpoint: int, request: bytes) -> bytes:
        if self.is_mute:
            return b""
        if endpoint == 0:
            rows = b"".join(struct.pack("<IH", *row) for row in self.endpoints)
            return payload(0, bytes([0, len(self.endpoints)]) + rows) + status(0)
        if endpoint == 3:
            told = struct.pack("<BIIBB", 1, *self.sweep_khz, self.direction, 7)
            return payload(3, told) + status(3)
        return self._base(request)

    def _base(self, request: bytes) -> bytes:
        command = request[0]
        if command in self.refuses:
            return status(1, self.refuses[command])
        match command:
            case 0x02:
                (self.interval_us,) = struct.unpack("<I", request[1:])
            case 0x41 if self.interval_us:
                return status(1, 1)  # busy
            case 0x41:
                self.format = request
            case 0x40:
                return payload(1, self.format) + status(1)
            case 0x34:
                return payload(1, struct.pack("<BI", 0x35, self.chirp_ns)) + status(1)
            case 0x01:
                self.frames += 1
                return self._damaged(payload(1, frame(self.frames, gain=self.gain)) + status(1))
        return status(1)

    def _damaged(self, answer: bytes) -> bytes:
        match self.damage.pop(0) if self.damage else "":
            case "lost byte":
                return answer[:1000] + answer[1001:]
            case "extra bytes":
                return answer[:2000] + b"\x5a\x5b\x00" + answer[2000:]
            case "wrong length":
                return answer[:2] + b"\xff\x3f" + answer[4:]
            case "noise before":
                return bytes(range(1, 80)) + answer
            case "cut short":
                return answer[:3000]
            case "nothing":
                return b""
        return answer


def plugged(folder: Path) -> AbstractContextManager[Position2GoBoard]:
    return plugged_in(Position2GoBoard(folder))
