"""A proxy between a ground station and a vehicle on UDP: it loses and delays datagrams, or is cut, one way or both."""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections.abc import AsyncIterator

Address = tuple[str, int]


class _Side(asyncio.DatagramProtocol):
    def __init__(self, proxy: Proxy) -> None:
        self._proxy = proxy

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self._proxy.on_datagram(self, data, addr)


class Proxy:
    """Ground stations talk to ``port``; whoever did so last is answered there."""

    def __init__(self, vehicle_port: int, loss: float, seed: int, delay_s: float) -> None:
        self._vehicle: Address = ("127.0.0.1", vehicle_port)
        self._random, self.loss, self.lost, self.carried = random.Random(seed), loss, 0, 0
        self.delay_s, self.is_cut, self.is_deaf = delay_s, False, False
        """``is_deaf``: nothing reaches the vehicle any more."""
        self._near, self._far = _Side(self), _Side(self)
        self._station: Address | None = None
        self.port = 0

    async def open(self) -> tuple[asyncio.DatagramTransport, asyncio.DatagramTransport]:
        loop = asyncio.get_running_loop()
        self._to_station, _ = await loop.create_datagram_endpoint(lambda: self._near, ("127.0.0.1", 0))
        self._to_vehicle, _ = await loop.create_datagram_endpoint(lambda: self._far, ("127.0.0.1", 0))
        self.port = self._to_station.get_extra_info("sockname")[1]
        return self._to_station, self._to_vehicle

    @property
    def far_address(self) -> Address:
        """As the vehicle sees this proxy."""
        return self._to_vehicle.get_extra_info("sockname")

    def on_datagram(self, side: _Side, data: bytes, addr: Address) -> None:
        if side is self._near:
            self._station = addr
        if self.is_cut or (self.is_deaf and side is self._near) or self._random.random() < self.loss:
            self.lost += 1
            return
        self.carried += 1
        to, where = (self._to_vehicle, self._vehicle) if side is self._near else (self._to_station, self._station)
        if where is not None and self.delay_s:
            asyncio.get_running_loop().call_later(self.delay_s, self._deliver, to, data, where)
        elif where is not None:
            to.sendto(data, where)

    @staticmethod
    def _deliver(to: asyncio.DatagramTransport, data: bytes, where: Address) -> None:
        if not to.is_closing():
            to.sendto(data, where)


@contextlib.asynccontextmanager
async def lossy_udp(vehicle_port: int, *, loss: float, seed: int = 0, delay_s: float = 0.0) -> AsyncIterator[Proxy]:
    proxy = Proxy(vehicle_port, loss, seed, delay_s)
    transports = await proxy.open()
    try:
        yield proxy
    finally:
        for transport in transports:
            transport.close()


class _Arm(asyncio.DatagramProtocol):
    """One of a router's ends."""

    def __init__(self, router: _Router) -> None:
        self._router = router
        self.transport: asyncio.DatagramTransport
        self.station: Address | None = None

    def datagram_received(self, data: bytes, addr: Address) -> None:
        self._router.on_datagram(self, data, addr)


class _Router:
    """As mavlink-router on board: the vehicle sees one station, and every end hears everything."""

    def __init__(self, vehicle_port: int, ends: int) -> None:
        self._vehicle: Address = ("127.0.0.1", vehicle_port)
        self.inner, self.arms = _Arm(self), [_Arm(self) for _ in range(ends)]

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        for arm in (self.inner, *self.arms):
            arm.transport, _ = await loop.create_datagram_endpoint(lambda arm=arm: arm, ("127.0.0.1", 0))

    def on_datagram(self, arm: _Arm, data: bytes, addr: Address) -> None:
        if arm is not self.inner:
            arm.station = addr
            self.inner.transport.sendto(data, self._vehicle)
            return
        for each in self.arms:
            if each.station is not None:
                each.transport.sendto(data, each.station)

    def close(self) -> None:
        for arm in (self.inner, *self.arms):
            arm.transport.close()


@contextlib.asynccontextmanager
async def routed_udp(vehicle_port: int, ends: int) -> AsyncIterator[list[int]]:
    """Ports at which the vehicle is reached."""
    router = _Router(vehicle_port, ends)
    await router.open()
    try:
        yield [arm.transport.get_extra_info("sockname")[1] for arm in router.arms]
    finally:
        router.close()
