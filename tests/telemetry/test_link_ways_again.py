"""A link that starts again, and the ways to the vehicle that the one before it had; on real sockets."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from telemetry.link.answering import OperatorRight
from telemetry.nodes.link import LinkNode, Memory, Wanted, read_memory
from telemetry.topics.messages import Candidate
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import UdpVehicle
from tests.telemetry.frames import heartbeat
from tests.telemetry.link_bench import console, until
from tests.telemetry.own_time import run
from tests.telemetry.test_link_several_ways import at, reached, used, vehicle
from tests.telemetry.udp_faults import lossy_udp


def test_a_link_that_starts_again_beats_on_all_ways_and_comes_back_with_them(tmp_path: Path) -> None:
    async def whole() -> None:
        async with (
            vehicle(speedup=1.0) as (_, port),
            lossy_udp(port, loss=0.0) as one,
            lossy_udp(port, loss=0.0) as other,
        ):
            written = tmp_path / "link.json"
            async with console() as bench:
                await reached(bench, at(one), at(other))
                await until(lambda: len(bench.link.peers.places) == 2)
                node = LinkNode(bench.link, OperatorRight(), cast(Any, SimpleNamespace()), written)
                await node.remember()
                memory = read_memory(written)
            assert [place.address for place in memory.ways] == [at(one), at(other)]
            assert memory.connections == (Wanted(at(one), True, True), Wanted(at(other), False, True))
            async with console() as bench:
                node = LinkNode(bench.link, OperatorRight(), cast(Any, SimpleNamespace()), written)
                one.is_cut = True
                await node.take_up(memory, [])
                await bench.live()
                assert used(bench) == at(other)
                one.is_cut = False
                await until(lambda: len(bench.status.ways) == 2)
                await until(lambda: all(each.identity == "known" for each in bench.status.ways))

    run(whole)


def test_while_a_vehicle_is_missed_nobody_else_is_adopted_in_its_stead() -> None:
    async def whole() -> None:
        was_at, elsewhere, started = (f"udpin:127.0.0.1:{free_port()}" for _ in range(3))
        missed = Candidate(f"{was_at}/x", was_at, f"127.0.0.1:{free_port()}", 1, 1, "ardupilot", 2)
        async with console() as bench:
            node = LinkNode(bench.link, OperatorRight(), cast(Any, SimpleNamespace()), Path("unused"))
            wanted = (Wanted(was_at, True, True), Wanted(elsewhere, True, True))
            await node.take_up(Memory(wanted, missed, ways=(missed,)), [was_at, elsewhere, started])
            assert [bench.link.peers.adopts_first_of(each) for each in (was_at, elsewhere, started)] == [
                True,
                False,
                False,
            ]
            others = [UdpVehicle(int(address.rpartition(":")[2])) for address in (elsewhere, started)]

            def heard_both() -> bool:
                for other in others:
                    other.send(heartbeat())
                return len(bench.status.candidates) == 2

            await until(heard_both)
            assert (bench.status.adopted, bench.link.session) == (missed, None)
        for other in others:
            other.close()

    run(whole)


def test_until_it_is_heard_again_the_vehicle_gets_heartbeats_at_every_place_that_was_known() -> None:
    async def whole() -> None:
        addresses = [f"udpin:127.0.0.1:{free_port()}" for _ in range(2)]
        radios = [UdpVehicle(int(address.rpartition(":")[2])) for address in addresses]
        first, second = (
            Candidate(f"{address}/x", address, f"127.0.0.1:{radio.port}", 1, 1, "ardupilot", 2)
            for address, radio in zip(addresses, radios, strict=True)
        )
        async with console() as bench:
            node = LinkNode(bench.link, OperatorRight(), cast(Any, SimpleNamespace()), Path("unused"))
            wanted = tuple(Wanted(address, False, True) for address in addresses)
            await node.take_up(Memory(wanted, first, ways=(first, second)), [])
            await until(lambda: all(radio.kinds() == {"HEARTBEAT"} for radio in radios))
            assert bench.status.adopted == first
            assert bench.status.state == "lost"
        for radio in radios:
            radio.close()

    run(whole)
