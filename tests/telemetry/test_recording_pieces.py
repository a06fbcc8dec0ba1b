"""A file put together of pieces: whatever is lost, repeated or overtakes, it is the same file or a named error."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.errors import StationsError
from telemetry.stations.recordings.asked_and_given import PIECE_BYTES
from telemetry.stations.recordings.pieces import IN_A_ROW, LEAST_UNDER_WAY, QUEUES_S, Bucket, Pace, Pieces


@settings(deadline=None)
@given(
    size=st.integers(1, 60 * PIECE_BYTES),
    have=st.integers(0, 10),
    lost=st.floats(0.0, 0.6),
    twice=st.floats(0.0, 0.6),
    seed=st.integers(0, 2**32),
)
def test_any_order_loss_and_repetition_gives_the_same_bytes(
    size: int, have: int, lost: float, twice: float, seed: int
) -> None:
    drawn = random.Random(seed)
    content = drawn.randbytes(size)
    begun = min(size, have * PIECE_BYTES)
    pieces, bucket, came = Pieces(size, begun), Bucket(1e6), bytearray(content[:begun])
    under_way, now_s = list[int](), 0.0
    while not pieces.is_whole:
        now_s += 0.5
        assert now_s < 10_000.0, "it comes to no end"
        asked = pieces.due(bucket, now_s, 16)
        under_way += [at for at in asked for _ in range(1 + (drawn.random() < twice)) if drawn.random() >= lost]
        drawn.shuffle(under_way)
        for _ in range(drawn.randint(0, len(under_way))):
            at = under_way.pop()
            came += pieces.on_piece(at, content[at : at + PIECE_BYTES], now_s)
        if drawn.random() < 0.05:
            pieces.forget_asked()
    assert bytes(came) == content


@given(
    size=st.integers(1, 10 * PIECE_BYTES), offset=st.integers(0, 12 * PIECE_BYTES), length=st.integers(1, PIECE_BYTES)
)
def test_a_piece_that_fits_nowhere_or_has_another_length_is_refused(size: int, offset: int, length: int) -> None:
    pieces = Pieces(size, 0)
    pieces.due(Bucket(1e9), 0.0, 16)
    fits = offset % PIECE_BYTES == 0 and offset < size and length == min(PIECE_BYTES, size - offset)
    if fits:
        pieces.on_piece(offset, bytes(length), 0.1)
    else:
        with pytest.raises(StationsError, match="came"):
            pieces.on_piece(offset, bytes(length), 0.1)
    assert pieces.have <= size


def test_pieces_without_end_that_nobody_asked_for_are_refused_and_never_kept() -> None:
    pieces = Pieces(100 * PIECE_BYTES, 0)

    def endless() -> None:
        for _ in range(1000):
            assert pieces.on_piece(50 * PIECE_BYTES, bytes(PIECE_BYTES), 0.1) == b""

    with pytest.raises(StationsError, match="without end"):
        endless()
    assert pieces.have == 0


def test_no_more_is_asked_for_than_the_budget_allows() -> None:
    pieces, bucket, asked = Pieces(10**7, 0), Bucket(8000.0), 0
    for turn in range(400):
        now_s = turn * 0.05
        for at in pieces.due(bucket, now_s, 16):
            asked += PIECE_BYTES
            pieces.on_piece(at, bytes(PIECE_BYTES), now_s + 0.01)
    assert 0.9 * 8000 * 20 < asked <= 8000 * 20 + 2 * PIECE_BYTES


def test_where_pieces_queue_up_on_the_way_fewer_are_under_way() -> None:
    pace, budget = Pace(), 1e9
    for step in range(400):
        pace.came(step * 0.1, step * 0.1 + 0.2)
    quick = pace.under_way(budget)
    assert quick > 10
    # A lost packet holds up a few: that is none. Many in a row slow once for all that were under way together; and
    # late ones again and again, down to the least.
    for _ in range(IN_A_ROW - 1):
        pace.came(40.0, 40.2 + QUEUES_S + 0.1)
    assert pace.under_way(budget) == quick
    for _ in range(4):
        pace.came(40.1, 40.2 + QUEUES_S + 0.2)
    assert pace.under_way(budget) == pytest.approx(quick / 2, abs=1.5)
    for step in range(60):
        pace.came(50.0 + 2 * step, 51.0 + 2 * step)
    assert pace.under_way(budget) == LEAST_UNDER_WAY


def test_a_budget_that_was_not_spent_is_not_saved_up() -> None:
    bucket = Bucket(8000.0)
    assert bucket.take(PIECE_BYTES, 0.0)
    bought = 0
    while bucket.take(PIECE_BYTES, 1000.0):
        bought += PIECE_BYTES
    assert 0 < bought <= 2 * PIECE_BYTES


def test_a_beginning_that_is_none_is_refused() -> None:
    for have in (-1, 1, PIECE_BYTES + 1, 3 * PIECE_BYTES):
        with pytest.raises(ValueError, match="whole pieces"):
            Pieces(2 * PIECE_BYTES, have)
    assert Pieces(2 * PIECE_BYTES - 1, 2 * PIECE_BYTES - 1).is_whole
