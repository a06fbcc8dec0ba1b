"""The data port's stream: layouts of SDK 2 and 3, and everything that can happen to bytes on a wire."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.sensors.ti_mmwave.packets import TiStream
from tests.telemetry.ti_packets import MAGIC, SDK2, packet, sdk2, sdk3, side_information, tlv

POINTS = [(1.0, 20.0, 0.5, -3.0), (-4.0, 60.0, 2.0, 0.31)]


def stream_of(numbers: range) -> list[bytes]:
    return [sdk3(n, POINTS[: n % 3], [20.0, 15.5][: n % 3]) for n in numbers]


def test_points_of_sdk_3_come_with_their_strength() -> None:
    (frame,) = TiStream().feed(sdk3(7, POINTS, [20.0, 15.5]))
    assert (frame.number, frame.sub_frame, frame.sdk, frame.platform) == (7, 0, (3, 5), 0xA1843)
    assert frame.xyz_m.tolist() == [[1.0, 20.0, 0.5], [-4.0, 60.0, 2.0]]
    assert frame.radial_speed_m_s == pytest.approx([-3.0, 0.31])
    assert frame.snr_db == pytest.approx([20.0, 15.5])
    assert frame.noise_db == pytest.approx([12.0, 12.0])


@pytest.mark.parametrize("sub_frame", [0, None], ids=["long header", "short header"])
def test_points_of_sdk_2_are_fixed_point_and_speeds_are_cells(sub_frame: int | None) -> None:
    data = sdk2(3, [(40, -10, -2.5, 19.75, 0.25), (9, 3, 0.5, 4.0, -1.0)], sub_frame=sub_frame)
    (frame,) = TiStream(velocity_cell_m_s=0.31).feed(data)
    assert frame.sdk == (2, 1)
    assert frame.xyz_m.tolist() == [[-2.5, 19.75, 0.25], [0.5, 4.0, -1.0]]
    assert frame.radial_speed_m_s == pytest.approx([-3.1, 0.93])
    assert np.isnan(frame.snr_db).all()


def test_speeds_in_cells_of_unknown_size_are_no_numbers() -> None:
    (frame,) = TiStream().feed(sdk2(3, [(40, -10, -2.5, 19.75, 0.25)]))
    assert np.isnan(frame.radial_speed_m_s).all()


def test_the_range_profile_is_read_and_other_parts_are_skipped() -> None:
    profile = np.arange(64, dtype="<u2")
    parts = [tlv(9, b"temperature!"), tlv(2, profile.tobytes()), tlv(1, struct.pack("<4f", *POINTS[0])),
             tlv(5, bytes(4096)), side_information([18.0])]  # fmt: skip
    (frame,) = TiStream().feed(packet(1, 1, parts))
    assert frame.range_profile.tolist() == list(range(64))
    assert frame.xyz_m.shape == (1, 3)
    assert frame.snr_db == pytest.approx([18.0])


def test_a_frame_without_targets_is_a_frame() -> None:
    stream = TiStream()
    (frame,) = stream.feed(sdk3(1, []))
    assert frame.xyz_m.shape == (0, 3)
    assert (stream.counts.frames, stream.counts.bad_bytes) == (1, 0)


@given(st.lists(st.integers(1, 400), min_size=1, max_size=20))
def test_how_bytes_are_cut_changes_nothing(sizes: list[int]) -> None:
    data, stream, found = b"".join(stream_of(range(5))), TiStream(), []
    for size in sizes:
        found += stream.feed(data[:size])
        data = data[size:]
    found += stream.feed(data)
    assert [frame.number for frame in found] == [0, 1, 2, 3, 4]
    assert stream.counts.bad_bytes == 0


@given(st.lists(st.binary(max_size=80), min_size=6, max_size=6))
def test_garbage_between_packets_is_counted_and_costs_no_packet(garbage: list[bytes]) -> None:
    # A magic word could only come about by chance; its first byte is kept out.
    clean = [piece.replace(b"\x02", b"\x00") for piece in garbage]
    packets = stream_of(range(5))
    data = clean[0] + b"".join(one + other for one, other in zip(packets, clean[1:], strict=True))
    stream = TiStream()
    assert [frame.number for frame in stream.feed(data)] == [0, 1, 2, 3, 4]
    stream.reset()
    assert stream.counts.bad_bytes == sum(map(len, clean))


@given(st.integers(0, 2), st.data())
def test_a_cut_packet_costs_itself_alone(which: int, data: st.DataObject) -> None:
    packets = stream_of(range(1, 5))
    hurt = packets[which]
    begin = data.draw(st.integers(0, len(hurt) - 1))
    end = data.draw(st.integers(begin + 1, len(hurt)))
    packets[which] = hurt[:begin] + hurt[end:]
    stream = TiStream()
    numbers = [frame.number for frame in stream.feed(b"".join(packets))]
    missing = {1, 2, 3, 4} - set(numbers)
    # A hole in the filling alone cannot be told from a packet that is short of it.
    assert missing <= {which + 1}
    assert stream.counts.bytes == sum(map(len, packets))
    assert stream.counts.lost_packets == (1 if missing and which > 0 else 0)


@given(st.binary(max_size=3000))
def test_no_bytes_break_it_and_the_next_packet_is_found(data: bytes) -> None:
    stream = TiStream()
    before = stream.feed(data)
    stream.feed(MAGIC)
    found = stream.feed(sdk3(77, POINTS, [20.0, 20.0]))
    assert found
    assert found[-1].number == 77
    assert len(before) <= len(data) // 36


@given(st.data())
def test_flipped_bits_never_break_it(data: st.DataObject) -> None:
    whole = bytearray(b"".join(stream_of(range(1, 4))))
    for _ in range(data.draw(st.integers(1, 8))):
        whole[data.draw(st.integers(0, len(whole) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    stream = TiStream()
    frames = stream.feed(bytes(whole))
    assert all(np.isfinite(frame.xyz_m).all() for frame in frames)
    frames += stream.reset()
    used = sum(frame.packet_bytes for frame in frames)
    assert stream.counts.bad_bytes + used == stream.counts.bytes == len(whole)
    assert stream.feed(sdk3(9, POINTS, [20.0, 20.0]))[-1].number == 9


def test_gaps_in_the_numbers_are_lost_packets() -> None:
    stream = TiStream()
    frames = stream.feed(b"".join(sdk3(n, POINTS[:1], [20.0]) for n in (5, 6, 9, 10, 3, 4)))
    assert [frame.lost_before for frame in frames] == [0, 0, 2, 0, 0, 0]
    assert stream.counts.lost_packets == 2


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [((5, 6, 7 + 512, 8, 9), (0, 0, 0, 0, 0)),
     ((1000, 1001, 1002 - 512, 1003, 1004), (0, 0, 0, 0, 0)),
     ((5, 6, 7 + 512, 10, 11), (0, 0, 0, 2, 0)),
     ((5, 6, 7 + 512, 8 + 2048, 9, 10), (0, 0, 0, 0, 0, 0)),
     ((5, 6, 60, 61), (0, 0, 53, 0)),
     ((5, 6, 60, 62), (0, 0, 53, 1)),
     ((5, 6, 1, 2, 3), (0, 0, 0, 0, 0)),
     ((5, 6, 90_000, 90_001), (0, 0, 0, 0)),
     ((5, 6, 26, 27), (0, 0, 19, 0))],
    ids=["flipped up", "flipped down", "flipped in a gap", "flipped twice", "gap", "gap in a gap", "begun anew",
         "far away", "small gap"],
)  # fmt: skip
def test_a_far_jump_of_the_number_is_believed_once_the_next_goes_on(
    numbers: tuple[int, ...], lost: tuple[int, ...]
) -> None:
    stream = TiStream()
    one_by_one = [frame for n in numbers for frame in stream.feed(sdk3(n, POINTS, [20.0, 15.5]))]
    assert [frame.number for frame in one_by_one] == list(numbers)
    assert [frame.lost_before for frame in one_by_one] == list(lost)
    assert (stream.counts.lost_packets, stream.counts.frames) == (sum(lost), len(numbers))


def test_the_last_frame_is_not_kept_for_its_number() -> None:
    stream = TiStream()
    (first,) = stream.feed(sdk3(1, POINTS, [20.0, 15.5]) + sdk3(500, POINTS, [20.0, 15.5]))
    assert first.number == 1
    (last,) = stream.reset()
    assert (last.number, last.lost_before) == (500, 0)
    assert stream.reset() == []
    assert [frame.number for frame in stream.feed(sdk3(3, POINTS, [20.0, 15.5]))] == [3]


def test_sub_frames_share_a_number() -> None:
    stream = TiStream()
    stream.feed(b"".join(sdk3(n, POINTS[:1], [20.0], sub_frame=k) for n in (5, 6, 7) for k in (0, 1)))
    assert (stream.counts.frames, stream.counts.lost_packets) == (6, 0)


@pytest.mark.parametrize(
    ("change", "at", "value"),
    [("length", 12, 35), ("length", 12, 1 << 20), ("version", 8, 0), ("version", 8, 0x09000000)],
)
def test_a_head_that_no_packet_has_is_passed_over_at_once(change: str, at: int, value: int) -> None:
    wrong = bytearray(sdk3(1, POINTS, [20.0, 20.0]))
    struct.pack_into("<I", wrong, at, value)
    stream = TiStream()
    (frame,) = stream.feed(bytes(wrong) + sdk3(2, POINTS, [20.0, 20.0]))
    assert (frame.number, stream.counts.implausible_lengths) == (2, 1), change
    assert stream.counts.bad_bytes == len(wrong)


@pytest.mark.parametrize(
    "wrong",
    [packet(1, 3, [tlv(1, bytes(32))]),
     packet(1, 1, []),
     packet(1, 1, [tlv(1, bytes(16)), side_information([20.0, 20.0])]),
     packet(1, 0, [tlv(2, bytes(7))]),
     packet(1, 5, [tlv(1, struct.pack("<2H", 4, 8) + bytes(60))], version=SDK2),
     packet(1, 5, [tlv(1, struct.pack("<2H", 5, 40) + bytes(60))], version=SDK2),
     packet(1, 5, [tlv(1, b"abc")], version=SDK2)],
    ids=["points", "no points", "side information", "profile", "descriptor", "fraction", "no descriptor"],
)  # fmt: skip
def test_parts_that_contradict_each_other_are_no_frame(wrong: bytes) -> None:
    stream = TiStream()
    (frame,) = stream.feed(wrong + sdk3(2, POINTS, [20.0, 20.0]))
    assert (frame.number, stream.counts.damaged_packets) == (2, 1)
    assert stream.counts.bad_bytes == len(wrong)


def test_absurd_points_are_left_out_and_counted() -> None:
    points = [POINTS[0], (math.nan, 1, 0, 0), (0, 5000, 0, 0), (0, 5, 0, 900), (math.inf, 0, 0, 0), (0, 5, 0, math.inf),
              (3e38, 3e38, 3e38, 0)]  # fmt: skip
    stream = TiStream()
    (frame,) = stream.feed(sdk3(1, points, [20.0] * 7))
    assert frame.xyz_m.tolist() == [[1.0, 20.0, 0.5]]
    assert frame.snr_db.shape == (1,)
    assert stream.counts.implausible_points == 6


def test_bytes_without_a_frame_are_counted_until_there_is_one() -> None:
    stream = TiStream()
    stream.feed(bytes(5000))
    assert stream.bytes_since_frame == 5000
    stream.feed(sdk3(1, POINTS, [20.0, 20.0]))
    assert stream.bytes_since_frame == 0


def test_memory_stays_bounded_whatever_comes() -> None:
    stream = TiStream()
    # The longest packet there is, announced again and again and never sent.
    head = MAGIC + struct.pack("<7I", 0x03050004, 1 << 16, 1, 1, 1, 1, 1)
    for _ in range(50):
        stream.feed(head + bytes(20_000))
    stream.reset()
    assert stream.counts.frames == 0
    assert stream.counts.bad_bytes == stream.counts.bytes
    assert stream.counts.damaged_packets == 49
