"""Free space: said before it runs out."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from telemetry.recording.disk_space import Space, running_out, space_at

GB = 1_000_000_000


def test_plenty_of_space_is_not_worth_a_word() -> None:
    assert running_out(Space(50 * GB, 100 * GB), 100_000.0, "recordings") is None


def test_little_space_is_said_with_what_it_is_good_for() -> None:
    warning = running_out(Space(76_777_216, 100 * GB), 100_000.0, "recordings")
    assert warning is not None
    assert "77 MB" in warning.what
    assert "10 minutes" in warning.what


def test_a_fast_recording_warns_earlier() -> None:
    space = Space(GB, 100 * GB)
    assert running_out(space, 10_000.0, "recordings") is None
    assert running_out(space, 5_000_000.0, "recordings") is not None


def test_hours_are_not_counted_in_minutes() -> None:
    warning = running_out(Space(200_000_000, 100 * GB), 1_000.0, "recordings")
    assert warning is not None
    assert "minutes" not in warning.what


@given(st.integers(0, 10**13), st.integers(0, 10**13))
def test_beginning_needs_more_than_going_on(free: int, total: int) -> None:
    space = Space(free, total)
    assert not (space.enough_to_begin and space.exhausted)
    assert space.reserve <= max(total // 50, 0)


def test_a_real_disk(tmp_path: Path) -> None:
    space = space_at(tmp_path)
    assert 0 <= space.free <= space.total
