"""Traffic over a real link: frames on sockets in, status and warnings on the bus out."""

from __future__ import annotations

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.geometry.frames import moved_deg
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.requests import Connect
from telemetry.topics.traffic import TrafficSettings, TrafficStatus
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import radio
from tests.telemetry.frames import ARMED, heartbeat, packed
from tests.telemetry.link_bench import ME, console, until
from tests.telemetry.own_time import run
from tests.telemetry.traffic_messages import HERE, adsb_message, e7


def position() -> Any:
    lat, lon = e7(HERE)
    return mavlink.MAVLink_global_position_int_message(1000, lat, lon, 500_000, 50_000, 500, 0, 0, 0)


def test_an_aircraft_on_the_wire_becomes_a_track_and_a_warning_by_the_settings_that_hold() -> None:
    async def whole() -> None:
        port = free_port()
        async with console() as bench:
            bench.link.on_traffic_settings(TrafficSettings(warn_distance_m=500.0))
            await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
            async with radio(port, message=heartbeat(base_mode=ARMED)) as vehicle:
                await until(lambda: bench.status.state == "live")

                def look() -> TrafficStatus | None:
                    vehicle.send(position())
                    # The receiver on board, over the same radio.
                    vehicle.send_bytes(packed(adsb_message(at=moved_deg(HERE, 5_000.0, 0.0)), component=156))
                    return bench.last(TrafficStatus)

                await until(lambda: (seen := look()) is not None and seen.aircraft and seen.aircraft[0].distance_m)
                (it,) = bench.last(TrafficStatus).aircraft
                assert (it.name, it.conflict) == ("HBABC", False)
                assert bench.last(TrafficStatus).settings.warn_distance_m == 500.0
                bench.link.on_traffic_settings(TrafficSettings())
                await until(lambda: (look(), bench.of(ObstacleAlert))[1])
            begun = bench.of(ObstacleAlert)[0]
            assert (begun.sensor, begun.phase) == ("traffic", "begins")
            assert begun.text.startswith("Traffic HBABC, ")
            assert {Topic.TRAFFIC, Topic.ALERT} <= {topic for topic, _ in bench.published}

    run(whole)
