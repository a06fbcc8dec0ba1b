"""Comparing what was sent with what the vehicle holds, and the digest of both."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavutil

from telemetry.mavlink.items import item_from_message, item_message
from telemetry.mavlink.verify import as_stored, compare, digest
from telemetry.topics.onboard_lists import Item
from tests.telemetry.lossy import VEHICLE, Codec
from tests.telemetry.mission_samples import mission, waypoint
from tests.telemetry.mission_vehicles import ArduCopter

STILL = (0.0, 0.0, 0.0, 0.0)
WIRE = Codec(VEHICLE)
seconds = st.floats(0, 60, width=32)
yaws = st.one_of(st.none(), st.sampled_from([0.0, 45.0, 90.0, 359.0]))
degrees_lat = st.integers(-899_999_999, 899_999_999).map(lambda e7: e7 / 1e7)
degrees_lon = st.integers(-1_799_999_999, 1_799_999_999).map(lambda e7: e7 / 1e7)
heights = st.one_of(st.floats(-100, 5000), st.integers(-1000, 500_000).map(lambda cm: cm / 100))
places = st.builds(
    Item,
    command=st.sampled_from([16, 19, 21, 22]),
    frame=st.sampled_from([0, 3, 5, 6, 10, 11]),
    params=st.tuples(seconds, st.just(0.0), st.just(0.0), yaws),
    lat_deg=degrees_lat,
    lon_deg=degrees_lon,
    alt_m=heights,
)
actions = st.builds(
    Item,
    command=st.sampled_from([20, 115, 178, 206, 2000]),
    frame=st.sampled_from([0, 2, 3]),
    params=st.tuples(*[st.floats(-1, 400, width=32)] * 4),
    lat_deg=st.just(0.0),
    lon_deg=st.just(0.0),
    alt_m=st.just(0.0),
)
missions = st.lists(st.one_of(places, actions), min_size=1, max_size=12).map(tuple)


def stored_by(items: tuple[Item, ...], firmware: Any) -> tuple[Item, ...]:
    """Over the wire into a vehicle and back: ArduCopter's storage, or one that keeps every float32."""
    sent = [item_message(item, k, target=(1, 1), number=k, firmware=firmware) for k, item in enumerate(items, start=1)]
    packed = [over_the_wire(message) for message in sent]
    kept = map(ArduCopter().keep, packed) if firmware == "ardupilot" else packed
    return tuple(item_from_message(over_the_wire(message)) for message in kept)


def over_the_wire(message: Any) -> Any:
    return WIRE.parse(WIRE.pack(message))


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@given(items=missions)
def test_the_digest_of_what_will_be_stored_is_that_of_what_is_found(firmware: Any, items: tuple[Item, ...]) -> None:
    found = stored_by(items, firmware)
    assert digest(as_stored(items, firmware)) == digest(found)


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
@given(items=missions)
def test_what_a_vehicle_stores_unchanged_is_verified(firmware: Any, items: tuple[Item, ...]) -> None:
    found = stored_by(items, firmware)
    rounded, differences = compare(items, found, firmware=firmware)
    assert differences == ()
    assert all(1 <= entry.item <= len(items) for entry in rounded)


@given(items=missions, data=st.data())
def test_any_flown_change_is_a_difference_and_another_digest(items: tuple[Item, ...], data: st.DataObject) -> None:
    found = list(stored_by(items, "ardupilot"))
    k = data.draw(st.integers(0, len(items) - 1))
    changed = data.draw(st.sampled_from(list(flown_changes(found[k]))))
    before, found[k] = tuple(found), changed
    _, differences = compare(before, tuple(found))
    assert differences
    assert str(k + 1) in differences[0]
    assert digest(before) != digest(tuple(found))


def flown_changes(item: Item) -> Iterator[Item]:
    yield replace(item, command=17 if item.command != 17 else 16)
    if item.command in (16, 19, 21, 22):
        yield replace(item, alt_m=item.alt_m + 0.02)
        yield replace(item, alt_m=item.alt_m - 0.02)
        yield replace(item, lat_deg=item.lat_deg + 3e-7)
        yield replace(item, lon_deg=item.lon_deg - 3e-7)
        yield replace(item, frame={0: 3, 3: 0, 10: 3}[item.frame])
    if item.command in (16, 19, 115, 178):
        p1, *rest = item.params
        assert p1 is not None
        yield replace(item, params=(p1 + 1.0, *rest))
        yield replace(item, params=(p1 - 1.0, *rest))
    if item.command == 178:
        p1, p2, *rest = item.params
        assert p2 is not None
        yield replace(item, params=(p1, p2 + 0.01, *rest))


def test_missing_items_are_a_difference() -> None:
    items = mission(10)
    for found in (items[:-1], (*items, waypoint(3)), ()):
        _, differences = compare(items, found)
        assert str(len(found)) in differences[0]
        assert digest(found) != digest(items)


def test_swapped_items_are_differences() -> None:
    items = (waypoint(1), waypoint(2), waypoint(3))
    _, differences = compare(items, (items[1], items[0], items[2]))
    assert len(differences) == 2
    assert digest(items) != digest((items[1], items[0], items[2]))


def test_what_ardupilot_rounds_is_told_field_by_field() -> None:
    sent = (Item(16, 6, (2.6, 0.5, 0.0, None), -37.0, 175.0, 32.94), Item(20, 2, STILL, 0.0, 0.0, 0.0))
    kept = (Item(16, 3, STILL, -37.0, 175.0, 32.93), Item(20, 0, STILL, 0.0, 0.0, 0.0))
    rounded, differences = compare(sent, (replace(kept[0], params=(2.0, 0.0, 0.0, 0.0)), kept[1]))
    assert differences == ()
    told = {entry.field: (entry.sent, entry.kept) for entry in rounded}
    assert told["altitude"] == (32.94, 32.93)
    assert told["parameter 1"] == (2.6, 2.0)
    assert told["parameter 2"] == (0.5, 0.0)
    assert told["parameter 4"] == (None, 0.0)
    assert {entry.item for entry in rounded} == {1}


def test_the_same_loss_is_a_difference_where_it_is_flown() -> None:
    sent = (Item(16, 3, (3.0, 0.0, 0.0, None), -37.0, 175.0, 20.0), Item(178, 2, (1.0, 4.0, -1.0, 0.0), 0.0, 0.0, 0.0))
    found = (replace(sent[0], params=(0.0, 0.0, 0.0, 0.0)), replace(sent[1], params=(1.0, 0.0, -1.0, 0.0)))
    _, differences = compare(sent, found)
    assert len(differences) == 2
    assert "Item 1: parameter 1 is 0 on board, sent was 3." in differences
    _, of_px4 = compare(sent[:1], (replace(sent[0], params=(3.0, 0.0, 0.0, 0.0)),), firmware="px4")
    assert of_px4 == ("Item 1: parameter 4 is 0 on board, sent was none.",)


@pytest.mark.parametrize("log", ["auto.tlog", "rejects.tlog"])
def test_a_recorded_upload_and_its_read_back_agree(shared_data: Path, log: str) -> None:
    sent, found = recorded_rows(shared_data / "logs" / "arducopter" / log)
    assert len(sent) == len(found) == 87
    rounded, differences = compare(sent, found)
    assert differences == ()
    assert {entry.field for entry in rounded} == {"altitude"}
    assert digest(as_stored(sent, "ardupilot")) == digest(found)


def recorded_rows(path: Path) -> tuple[tuple[Item, ...], tuple[Item, ...]]:
    """What was sent last and what was read back, home left out."""
    log = mavutil.mavlink_connection(str(path))
    sent: dict[int, Any] = {}
    found: dict[int, Any] = {}
    try:
        while (message := log.recv_match(type=["MISSION_ITEM_INT", "MISSION_COUNT"], blocking=False)) is not None:
            if message.get_type() == "MISSION_COUNT":
                if message.get_srcSystem() == 255:
                    sent.clear()
                continue
            (sent if message.get_srcSystem() == 255 else found)[message.seq] = message
    finally:
        log.close()
    return tuple(tuple(item_from_message(rows[k]) for k in sorted(rows) if k > 0) for rows in (sent, found))  # type: ignore[return-value]
