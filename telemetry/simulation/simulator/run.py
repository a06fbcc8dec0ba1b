"""The simulated vehicle as a program: time, sockets, start and clean stop."""

from __future__ import annotations

import asyncio
import contextlib
import math
import signal
from collections.abc import AsyncIterator, Callable, Hashable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.errors import ParameterError
from telemetry.simulation.simulator.airframe.battery import Pack
from telemetry.simulation.simulator.airframe.gnss import GnssKind
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES, Make
from telemetry.simulation.simulator.ground_below import Ground, Obstacles, SurfaceGround
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.protocol.mavlink import Endpoint
from telemetry.simulation.simulator.protocol.transports import Transport, open_transport, parse_where
from telemetry.simulation.simulator.simulated_vehicle import SimulatedVehicle

SLICE_S = 0.02
"""Simulated time between looks at the streams."""
TICK_S = 0.01
MOST_OWED_S = 0.1
"""A machine that cannot keep up, or slept, loses simulated time beyond this much wall time."""


@dataclass(frozen=True, slots=True)
class SimOptions:
    """How a simulated vehicle is started."""

    home_lat_deg: float
    home_lon_deg: float
    home_alt_amsl_m: float
    autopilot: Make = "ardupilot"
    """Whose behaviour it has: ArduCopter's or PX4's."""
    link: str = "tcpin:127.0.0.1:5760"
    """Where ground stations find it: udpout:HOST:PORT, udpin:HOST:PORT or tcpin:HOST:PORT."""
    speedup: float = 1.0
    """Simulated seconds per second."""
    seed: int = 0
    gnss: GnssKind = "rtk"
    wind_m_s: float = 0.0
    wind_from_deg: float = 225.0
    dsm: Path | None = None
    """Surface model that stands around the vehicle; None: level ground, or what the world file names."""
    world: Path | None = None
    """World file: what else stands there, to fly into (docs/worlds.md)."""
    gnss_script: tuple[GnssEvent, ...] = ()
    """When its positions fail."""
    boot_s: float = 3.0
    """Simulated time until the position is known; a real vehicle takes about 40 s."""
    endurance_s: float = 1200.0
    """Of hovering."""
    traffic: bool = False
    """Whether its receiver tells of an aircraft that flies past."""
    parameter_errors: bool = False
    """Whether it says so when it has no such parameter, as newer firmware does."""
    parameters: tuple[tuple[str, float], ...] = field(default=())
    """Autopilot parameters that differ from its defaults."""


class Simulator:
    """One simulated vehicle on one transport. ``await open()``, ``await fly()`` for ever, ``close()``."""

    def __init__(self, options: SimOptions) -> None:
        self.options = options
        self.vehicle = _vehicle(options)
        self.endpoint = Endpoint(self.vehicle, traffic=options.traffic, parameter_errors=options.parameter_errors)
        self._channels: dict[Hashable, _Channel] = {}
        self._key: tuple[bytes, int] | None = None
        """With which it signs, and the time that it was given with it."""
        self._transport: Transport | None = None

    @property
    def address(self) -> str:
        """Where it is reached, with the port that was really taken."""
        return str(self._open.where)

    @property
    def start_line(self) -> str:
        options = self.options
        place = f"{options.home_lat_deg:.7f}, {options.home_lon_deg:.7f}, {options.home_alt_amsl_m:.1f} m"
        return f"Simulated vehicle at {place}, {options.speedup:g} x real time: {self._open.where.hint}"

    async def open(self) -> None:
        """ConnectionFailedError when the port is not to be had."""
        self._transport = await open_transport(parse_where(self.options.link), self)

    async def fly(self) -> None:
        loop = asyncio.get_running_loop()
        last_s, owed_s = loop.time(), 0.0
        while True:
            await asyncio.sleep(TICK_S)
            now_s = loop.time()
            owed_s += min(now_s - last_s, MOST_OWED_S) * self.options.speedup
            last_s = now_s
            while owed_s >= SLICE_S and loop.time() - now_s < MOST_OWED_S:
                owed_s -= SLICE_S
                self.vehicle.advance(SLICE_S)
                self._send(self.endpoint.on_slice(now_s))
            owed_s = min(owed_s, MOST_OWED_S * self.options.speedup)

    def close(self) -> None:
        if self._transport:
            self._transport.close()

    @property
    def _open(self) -> Transport:
        assert self._transport is not None, "open() comes first"
        return self._transport

    # What the transport tells.

    def joined(self, peer: Hashable) -> None:
        channel = self._channels[peer] = _Channel(self.endpoint)
        channel.use_key(self._key)
        self.endpoint.connect(peer)

    def left(self, peer: Hashable) -> None:
        self._channels.pop(peer, None)
        self.endpoint.disconnect(peer)

    def received(self, peer: Hashable, data: bytes) -> None:
        now_s = asyncio.get_running_loop().time()
        for message in self._channels[peer].read(data):
            if message.get_type() == "SETUP_SIGNING":
                self._set_key(message)
                continue
            self._send(self.endpoint.on_message(message, peer, now_s))

    def _set_key(self, message: Any) -> None:
        """As ArduCopter: never while armed; a key and a time of nothing but zeros switch signing off."""
        if self.vehicle.autopilot.armed or message.target_system != self.endpoint.system_id:
            return
        key = bytes(message.secret_key)
        self._key = (key, message.initial_timestamp) if any(key) or message.initial_timestamp else None
        for channel in self._channels.values():
            channel.use_key(self._key)

    def _send(self, replies: list[Reply]) -> None:
        for peer, message in replies:
            if channel := self._channels.get(peer):
                self._open.send(peer, channel.write(message))


class _Channel:
    """Frames to and from one ground station; one that has only ever spoken MAVLink 1 is answered in it."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._codec = wire.MAVLink(None)
        self._codec.robust_parsing = True
        self._endpoint = endpoint
        self._newest: int | None = None

    def use_key(self, key: tuple[bytes, int] | None) -> None:
        """pymavlink's own signing: it has no clock, and follows the time of what it hears."""
        signing = wire.MAVLinkSigning()
        if key is not None:
            signing.secret_key, signing.timestamp = key
            signing.sign_outgoing = True
            signing.allow_unsigned_callback = lambda _, number: (
                number
                in (
                    wire.MAVLINK_MSG_ID_RADIO_STATUS,
                    wire.MAVLINK_MSG_ID_RADIO,
                )
            )
        self._codec.signing = signing

    def read(self, data: bytes) -> Iterable[wire.MAVLink_message]:
        for message in self._codec.parse_buffer(data) or []:
            if message.get_type() == "BAD_DATA":
                continue
            version = 1 if message.get_msgbuf()[0] == wire.PROTOCOL_MARKER_V1 else 2
            self._newest = max(version, self._newest or 1)
            yield message

    def write(self, message: wire.MAVLink_message) -> bytes:
        codec = self._codec
        codec.srcSystem, codec.srcComponent = self._endpoint.system_id, self._endpoint.component_id
        old = self._newest == 1
        if old and message.get_msgId() > 255:
            return b""
        data = message.pack(codec, force_mavlink1=old)
        codec.seq = (codec.seq + 1) % 256
        return bytes(data)


@contextlib.asynccontextmanager
async def flying(options: SimOptions) -> AsyncIterator[Simulator]:
    """A simulated vehicle in this event loop, for as long as the block lasts."""
    simulator = Simulator(options)
    await simulator.open()
    try:
        async with asyncio.TaskGroup() as group:
            task = group.create_task(simulator.fly())
            try:
                yield simulator
            finally:
                task.cancel()
    finally:
        simulator.close()


def run(options: SimOptions, *, announce: Callable[[str], None] = print) -> None:
    """Fly until SIGINT or SIGTERM. Wrong options and addresses raise ``DescribedError``."""
    asyncio.run(_until_stopped(options, announce))


async def _until_stopped(options: SimOptions, announce: Callable[[str], None]) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    async with flying(options) as simulator:
        announce(simulator.start_line)
        await stop.wait()


def _vehicle(options: SimOptions) -> SimulatedVehicle:
    _check(options)
    frame = NeuFrame(options.home_lat_deg, options.home_lon_deg, options.home_alt_amsl_m)
    capacity_mah = Pack().hover_a * options.endurance_s / 3.6
    personality = PERSONALITIES[options.autopilot]
    parameters = personality.parameters(SIM_WIND_SPD=options.wind_m_s, SIM_WIND_DIR=options.wind_from_deg)
    parameters.set(personality.capacity, capacity_mah)
    for name, value in options.parameters:
        parameters.set(name, value)
    ground, obstacles = _surroundings(options, frame)
    return SimulatedVehicle(
        frame,
        make=options.autopilot,
        ground=ground,
        obstacles=obstacles,
        seed=options.seed,
        gnss=options.gnss,
        gnss_script=options.gnss_script,
        parameters=parameters,
        boot_s=options.boot_s,
        speedup=options.speedup,
    )


def _surroundings(options: SimOptions, frame: NeuFrame) -> tuple[Ground | None, Obstacles | None]:
    # What reads rasters and casts rays takes a second to load; level ground starts without it.
    if options.dsm is None and options.world is None:
        return None, None
    from planning.terrain.geotiff import read_dsm

    dsm = read_dsm(options.dsm) if options.dsm else None
    if options.world is None:
        return SurfaceGround(dsm, frame) if dsm else None, None
    from telemetry.simulation.simulator.scene import World

    world = World.load(options.world, frame=frame, dsm=dsm)
    return world.ground, world


def _check(options: SimOptions) -> None:
    limits = (
        ("latitude of home", options.home_lat_deg, -85.0, 85.0),
        ("longitude of home", options.home_lon_deg, -180.0, 180.0),
        ("height of home", options.home_alt_amsl_m, -500.0, 9000.0),
        ("speed-up", options.speedup, 0.1, 100.0),
        ("wind", options.wind_m_s, 0.0, 40.0),
        ("wind direction", options.wind_from_deg, 0.0, 360.0),
        ("boot time", options.boot_s, 0.0, 600.0),
        ("endurance", options.endurance_s, 10.0, 1e6),
    )
    for name, value, low, high in limits:
        if not (math.isfinite(value) and low <= value <= high):
            raise ParameterError(
                f"The {name} is {value:g}.",
                where="simulated vehicle",
                advice=f"Give a value from {low:g} to {high:g}.",
            )
    specs = PERSONALITIES[options.autopilot].specs
    unknown = [name for name, _ in options.parameters if name not in specs]
    if unknown:
        raise ParameterError(
            f"The simulated autopilot has no parameter {unknown[0]}.",
            where="simulated vehicle",
            advice=f"It has {', '.join(specs)}.",
        )
