"""Ranges of the vehicle's own sensors, against what the MAVLink definitions say of each field."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.sensor_frames import RangeFrame
from telemetry.mavlink.ranges import RangeReader
from telemetry.topics.messages import Topic
from telemetry.topics.requests import Connect
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import radio
from tests.telemetry.link_bench import ME, console, until
from tests.telemetry.own_time import run

NOTHING, UNKNOWN = 1001, 65535


def over_the_air(message: Any) -> Any:
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=195)
    return mavlink.MAVLink(None).decode(bytearray(message.pack(link)))


def sectors(distances_cm: list[int], **changes: Any) -> Any:
    fields = {"increment": 5, "min_distance": 20, "max_distance": 1000, "increment_f": 0.0, "angle_offset": 0.0}
    fields |= {"frame": 12} | changes
    distances = distances_cm + [UNKNOWN] * (72 - len(distances_cm))
    return over_the_air(mavlink.MAVLink_obstacle_distance_message(0, 0, distances, **fields))


def single(distance_cm: int, orientation: int, **changes: Any) -> Any:
    fields: dict[str, Any] = {"min_distance": 20, "max_distance": 1000, "type": 0, "id": 3, "covariance": 0} | changes
    return over_the_air(
        mavlink.MAVLink_distance_sensor_message(0, current_distance=distance_cm, orientation=orientation, **fields)
    )


def read(message: Any, heading_rad: float | None = 0.0) -> RangeFrame | None:
    return RangeReader().on_message(message, heading_rad=heading_rad, t_mono_s=5.0, t_utc_s=6.0)


def test_sectors_run_clockwise_from_the_nose_and_only_hits_count() -> None:
    frame = read(sectors([300, NOTHING, UNKNOWN, 450]))
    assert frame is not None
    assert frame.range_m == (3.0, 4.5)
    assert frame.bearing_rad == pytest.approx((0.0, math.radians(15.0)))
    assert frame.elevation_rad == (0.0, 0.0)
    assert (frame.t_mono_s, frame.t_utc_s, frame.number) == (5.0, 6.0, 0)
    assert frame.source == "OBSTACLE_DISTANCE 195"


@given(st.floats(0, 6.28), st.floats(0.5, 10), st.floats(-180, 180))
def test_sectors_that_are_aligned_to_north_are_turned(heading: float, step: float, offset: float) -> None:
    frame = read(sectors([500, 600], increment_f=step, angle_offset=offset, frame=0), heading)
    assert frame is not None
    for number, bearing in enumerate(frame.bearing_rad):
        wanted = math.radians(offset + number * step) - heading
        assert math.cos(bearing - wanted) == pytest.approx(1.0, abs=1e-6)


def test_without_a_heading_north_says_nothing() -> None:
    assert read(sectors([500], frame=0), None) is None
    assert read(sectors([500], increment=0)) is None


@pytest.mark.parametrize(("orientation", "bearing", "elevation"), [(0, 0, 0), (2, 90, 0), (25, 0, -90), (24, 0, 90)])
def test_a_single_range_points_where_it_is_mounted(orientation: int, bearing: float, elevation: float) -> None:
    frame = read(single(250, orientation))
    assert frame is not None
    assert (frame.range_m, frame.source) == ((2.5,), "DISTANCE_SENSOR 195/3")
    assert frame.bearing_rad == pytest.approx((math.radians(bearing),))
    assert frame.elevation_rad == pytest.approx((math.radians(elevation),))


def test_out_of_range_is_a_frame_without_hits_and_nonsense_is_none() -> None:
    frame = read(single(1500, 0))
    assert frame is not None
    assert frame.range_m == ()
    assert read(single(250, 100)) is None
    assert read(single(250, 0, signal_quality=1)) is None
    assert read(over_the_air(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 0, 3))) is None


def test_every_sensor_counts_for_itself() -> None:
    reader = RangeReader()
    messages = [single(250, 0, id=1), single(250, 2, id=2), single(250, 0, id=1), sectors([500])]
    frames = [reader.on_message(m, heading_rad=0.0, t_mono_s=0.0, t_utc_s=0.0) for m in messages]
    assert [frame.number for frame in frames if frame is not None] == [0, 0, 1, 0]


def test_ranges_of_the_adopted_vehicle_go_out_on_the_bus() -> None:
    async def whole() -> None:
        port = free_port()
        async with console() as bench:
            await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
            async with radio(port) as vehicle:
                await bench.live()
                vehicle.send(single(250, 0))
                await until(lambda: bench.of(RangeFrame))
            (topic,) = {topic for topic, message in bench.published if isinstance(message, RangeFrame)}
            assert topic == Topic.RANGE_FRAME
            assert bench.last(RangeFrame).range_m == (2.5,)

    run(whole)
