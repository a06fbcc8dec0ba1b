"""What was seen in a flight counts until its landing, though its map begins anew or dies; losses are said."""

from __future__ import annotations

from typing import Any

import pytest

from server.scene.mirror import MapMirror
from telemetry.topics.obstacles import MapOrigin
from tests.server.obstacle_messages import ORIGIN, delta, voxels_in


def kept_in(mirror: MapMirror) -> set[tuple[int, ...]]:
    seen = mirror.seen()
    assert seen is not None
    return {tuple(key) for voxels in seen for key in voxels.keys[~voxels.explained].tolist()}


CRANE, GROUND, ELSEWHERE = (4, 0, 20), (4, 0, 0), MapOrigin(37.8, 15.0, 1712.0)


def in_flight() -> MapMirror:
    """With a crane on known ground, seen in this flight."""
    mirror = MapMirror("radar")
    mirror.on_flight(flies=True)
    mirror.fold(delta([CRANE, GROUND], explained=[0, 1], whole=True, revision=7, began_mono_s=1.0))
    return mirror


@pytest.mark.parametrize(
    "again",
    [
        {"began_mono_s": 2.0},
        {"began_mono_s": 2.0, "revision": 9},
        {"origin": ELSEWHERE},
        {"resolution_m": 0.5},
        {"revision": 6, "began_mono_s": 1.0},
        {"whole": False, "since": 8, "revision": 9, "began_mono_s": 2.0},
    ],
    ids=["started again", "and much seen", "home moved", "finer", "revision went back", "its beginning was missed"],
)
def test_what_was_seen_in_flight_counts_when_the_map_begins_anew(again: dict[str, Any]) -> None:
    mirror = in_flight()
    mirror.fold(delta([], **{"whole": True, "revision": 0, **again}))
    if not mirror.is_complete:
        assert mirror.seen() is None
        mirror.fold(delta([], **{**again, "whole": True}))
    assert (kept_in(mirror), mirror.voxel_count, mirror.kept_count) == ({CRANE}, 0, 1)
    mirror.on_flight(flies=False)
    assert (kept_in(mirror), mirror.kept_count) == (set(), 0)


def test_what_was_kept_stays_until_the_landing_whatever_the_new_map_sees_there() -> None:
    """No map tells places that it only ever saw free: what is not told there says nothing."""
    mirror = in_flight()
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    for looked in ({"probability": 20}, {"explained": 1}):
        mirror.fold(delta([CRANE], since=0, revision=1, began_mono_s=2.0, **looked))
        assert (kept_in(mirror), mirror.kept_count) == ({CRANE}, 1)


def test_what_the_same_map_says_is_free_is_not_kept() -> None:
    mirror = in_flight()
    mirror.fold(delta([], whole=True, revision=8, began_mono_s=1.0))
    assert kept_in(mirror) == set()
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    assert kept_in(mirror) == set()


@pytest.mark.parametrize("answer", [{"began_mono_s": 2.0, "revision": 0}, {"began_mono_s": 1.0, "revision": 8}])
def test_what_is_emptied_by_order_is_gone_however_the_node_answers(answer: dict[str, Any]) -> None:
    mirror = in_flight()
    mirror.fold(delta([(1, 1, 9)], whole=True, revision=0, began_mono_s=1.5))
    assert kept_in(mirror) == {CRANE, (1, 1, 9)}
    mirror.dismiss(5)
    assert (mirror.seen(), mirror.voxel_count, mirror.kept_count) == ((), 0, 0)
    # Told before its node heard of the order.
    assert mirror.fold(delta([CRANE], since=7, revision=8, began_mono_s=1.5, clear_count=4))
    assert mirror.seen() == ()
    mirror.expect(10.0)
    assert mirror.seen() is None, "its node has not answered yet, and holds something"
    mirror.fold(delta([], whole=True, clear_count=5, **answer))
    assert (kept_in(mirror), mirror.has_forgotten) == (set(), False)
    mirror.fold(
        delta([CRANE], since=answer["revision"], revision=9, clear_count=5, began_mono_s=answer["began_mono_s"])
    )
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=3.0, clear_count=5))
    assert kept_in(mirror) == {CRANE}, "the order was for what was there then"


def test_a_map_that_is_told_again_and_breaks_off_takes_nothing_with_it() -> None:
    mirror, other = in_flight(), (9, 9, 9)
    mirror.fold(delta([other], whole=True, revision=7, parts=2, began_mono_s=1.0))
    assert mirror.seen() is None
    assert voxels_in(mirror).keys() == {CRANE, GROUND}, "what is drawn stays until the last part is there"
    assert {tuple(k) for v in mirror.seen_so_far() for k in v.keys.tolist()} == {CRANE, GROUND, other}
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    assert (kept_in(mirror), mirror.has_forgotten) == ({CRANE, other}, False)


def test_a_map_that_is_told_again_twice_is_what_it_was_told_last() -> None:
    mirror, other = in_flight(), (9, 9, 9)
    mirror.fold(delta([other], whole=True, revision=7, parts=3, began_mono_s=1.0))
    again = [delta([(k, 0, 5)], whole=True, revision=8, part=k, parts=2, began_mono_s=1.0) for k in range(2)]
    mirror.fold(again[0])
    assert voxels_in(mirror).keys() == {CRANE, GROUND, other}, "what came of the first try counts meanwhile"
    mirror.taken_dirty()
    mirror.fold(again[1])
    assert kept_in(mirror) == {(0, 0, 5), (1, 0, 5)}
    assert mirror.taken_dirty() == {(0, 0, 0)}
    assert mirror.fold(delta([other], since=8, revision=9, began_mono_s=1.0))
    assert kept_in(mirror) == {(0, 0, 5), (1, 0, 5), other}


def test_parts_that_are_known_to_be_lost_with_their_node_are_said() -> None:
    mirror = in_flight()
    mirror.fold(delta([(1, 1, 9)], since=9, revision=10, began_mono_s=1.0))
    assert mirror.seen() is None
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    assert (kept_in(mirror), mirror.has_forgotten) == ({CRANE, (1, 1, 9)}, True)
    mirror.on_flight(flies=False)
    assert not mirror.has_forgotten


def test_a_part_of_another_map_does_not_follow() -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([CRANE], whole=True, revision=3, parts=2, began_mono_s=1.0))
    assert not mirror.fold(delta([GROUND], whole=True, revision=3, part=1, parts=2, began_mono_s=2.0))
    assert mirror.seen() is None


def test_a_flight_begins_in_the_air_with_nothing_kept() -> None:
    """Arming sets home, and maps begin anew around it: who stands beside the vehicle then goes away."""
    mirror = MapMirror("radar")
    mirror.fold(delta([GROUND], whole=True, began_mono_s=1.0))
    mirror.fold(delta([(1, 1, 0)], whole=True, began_mono_s=2.0))
    mirror.fold(delta([], whole=True, began_mono_s=3.0, origin=ELSEWHERE))
    mirror.on_flight(flies=True)
    assert mirror.kept_count == 0
    mirror.fold(delta([CRANE], since=1, revision=2, began_mono_s=3.0, origin=ELSEWHERE))
    mirror.fold(delta([], whole=True, began_mono_s=4.0))
    assert kept_in(mirror) == {CRANE}


def test_what_was_seen_in_a_flight_before_is_not_kept_in_this_one() -> None:
    mirror = in_flight()
    mirror.on_flight(flies=False)
    mirror.on_flight(flies=True)
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    assert kept_in(mirror) == set()


@pytest.mark.parametrize("came", ["a part of it", "all of it"])
def test_a_map_of_a_flight_before_that_is_told_again_stays_one(came: str) -> None:
    """From its start, by the node or the bus, whatever of it was here."""
    mirror = in_flight()
    if came == "a part of it":
        mirror.fold(delta([CRANE], whole=True, revision=8, parts=2, began_mono_s=1.0))
    mirror.on_flight(flies=False)
    for revision in (8, 3):
        mirror.fold(delta([CRANE], whole=True, revision=revision, began_mono_s=1.0))
    mirror.on_flight(flies=True)
    mirror.fold(delta([CRANE], whole=True, revision=2, began_mono_s=1.0))
    mirror.fold(delta([(1, 1, 9)], whole=True, revision=1, began_mono_s=2.0))
    assert kept_in(mirror) == {(1, 1, 9)}, "the crane is of the flight before"
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=3.0))
    assert kept_in(mirror) == {(1, 1, 9)}, "what was seen since counts where its node dies"


@pytest.mark.parametrize(
    ("told", "is_of_this_flight"),
    [
        ({"keys": [(50, 50, 5)], "since": 7, "revision": 8}, True),
        ({"keys": [CRANE], "since": 7, "revision": 8}, True),
        ({"keys": [(50, 50, 5)], "since": 7, "revision": 8, "explained": 1}, False),
        ({"keys": [CRANE], "since": 7, "revision": 8, "probability": 20}, False),
        ({"keys": [], "since": 8, "revision": 9}, True),
        ({"keys": [CRANE, GROUND], "whole": True, "revision": 9, "explained": [0, 1]}, False),
        ({"keys": [CRANE, (50, 50, 5)], "whole": True, "revision": 9}, True),
        ({"keys": [CRANE, (50, 50, 5)], "whole": True, "revision": 7}, False),
        ({"keys": [CRANE], "whole": True, "revision": 9, "parts": 2}, False),
        ({"keys": [(50, 50, 5)], "whole": True, "revision": 9, "parts": 2}, True),
    ],
    ids=[
        "seen", "seen again", "known ground", "free", "something never came", "told again",
        "told again with more", "as it was", "half told again", "half told again with more",
    ],
)  # fmt: skip
def test_what_is_seen_in_a_map_that_runs_on_over_a_landing_counts_where_that_map_dies(
    told: dict[str, Any], *, is_of_this_flight: bool
) -> None:
    mirror = in_flight()
    for flies in (False, True):
        mirror.on_flight(flies=flies)
    mirror.fold(delta(**told, began_mono_s=1.0))
    before = {tuple(key) for voxels in mirror.seen_so_far() for key in voxels.keys[~voxels.explained].tolist()}
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    assert kept_in(mirror) == (before if is_of_this_flight else set())
    assert mirror.has_forgotten is (told["keys"] == [])


def test_a_map_that_never_came_whole_before_the_flight_is_of_it_once_more_is_told() -> None:
    for revision, is_of_this_flight in ((8, False), (9, True)):
        mirror = in_flight()
        mirror.fold(delta([CRANE], whole=True, revision=8, parts=2, began_mono_s=1.0))
        for flies in (False, True):
            mirror.on_flight(flies=flies)
        assert mirror.origin is None
        mirror.fold(delta([CRANE], whole=True, revision=revision, began_mono_s=1.0))
        mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
        assert kept_in(mirror) == ({CRANE} if is_of_this_flight else set())


def test_a_map_that_was_emptied_on_the_ground_is_of_the_flight_that_follows() -> None:
    mirror = in_flight()
    mirror.on_flight(flies=False)
    mirror.dismiss(1)
    mirror.fold(delta([], whole=True, revision=9, began_mono_s=1.0, clear_count=1))
    mirror.on_flight(flies=True)
    mirror.fold(delta([CRANE], since=9, revision=10, began_mono_s=1.0, clear_count=1))
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0, clear_count=1))
    assert kept_in(mirror) == {CRANE}


def test_a_map_that_never_came_whole_is_waited_for_no_longer_than_the_flight() -> None:
    mirror = in_flight()
    mirror.fold(delta([CRANE], whole=True, revision=8, parts=2, began_mono_s=1.0))
    generation = mirror.generation
    mirror.on_flight(flies=False)
    assert (mirror.seen(), mirror.origin, mirror.generation) == ((), None, generation + 1)
    whole = in_flight()
    whole.on_flight(flies=False)
    assert kept_in(whole) == {CRANE}, "what is whole may still be looked at"


def test_maps_around_many_homes_are_kept_and_more_than_fits_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    mirror = in_flight()
    for number in range(40):
        mirror.fold(delta([CRANE], whole=True, origin=MapOrigin(38.0, 15.0, float(number))))
    mirror.fold(delta([(1, 1, 9)], whole=True, origin=MapOrigin(38.0, 15.0, 3.0)))
    mirror.fold(delta([], whole=True, origin=ELSEWHERE))
    assert (mirror.kept_count, mirror.has_forgotten) == (42, False)
    assert mirror.seen() is not None
    assert len(mirror.seen() or ()) == 42, "two maps around one home are one, and one is the present"
    monkeypatch.setattr("server.scene.kept_voxels.MOST_VOXELS", 42)
    mirror.fold(delta([CRANE], whole=True, origin=ELSEWHERE))
    mirror.fold(delta([], whole=True, origin=ORIGIN))
    assert (mirror.kept_count, mirror.has_forgotten) == (42, True)


def test_what_is_kept_costs_no_fold_anything() -> None:
    mirror = in_flight()
    mirror.fold(delta([], whole=True, revision=0, began_mono_s=2.0))
    kept = mirror._kept.grids
    before = dict(kept)
    mirror.fold(delta([CRANE], 20, since=0, revision=1, began_mono_s=2.0))
    assert all(kept[grid] is before[grid] for grid in before)


PARTS = [delta([(k, 0, 0)], whole=True, revision=9, part=k, parts=3) for k in range(3)]


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_half_a_map_is_not_taken_for_one(lost: int) -> None:
    mirror = MapMirror("radar")
    mirror.fold(delta([CRANE], whole=True, revision=8))
    follows = list[bool]()
    for number, part in enumerate(PARTS):
        if number != lost:
            folds = mirror.folds
            follows.append(mirror.fold(part))
            assert mirror.folds > folds
        assert mirror.seen() is None or (lost, number) == (0, 0), "nothing has come yet"
    next_one = delta([(7, 0, 0)], since=9, revision=10)
    follows.append(mirror.fold(next_one))
    assert not all(follows)
    assert mirror.seen() is None, "what follows does not mend it"
    for part in PARTS:
        assert mirror.fold(part)
    assert mirror.fold(next_one)
    assert kept_in(mirror) == {(0, 0, 0), (1, 0, 0), (2, 0, 0), (7, 0, 0)}


def test_what_is_said_to_be_there_and_was_not_heard_is_missing() -> None:
    mirror = MapMirror("radar")
    assert mirror.seen() == ()
    mirror.expect(10.0)
    assert mirror.seen() is None
    mirror.fold(delta([CRANE], whole=True))
    assert kept_in(mirror) == {CRANE}
    mirror.expect(10.0)
    assert mirror.is_complete


@pytest.mark.parametrize(
    ("words", "began_mono_s", "is_lost"),
    [
        ([(20.0, "a")], 3.0, False),
        ([(20.0, "a")], 20.4, False),  # it was told a little after it was said to hold something
        ([(20.0, "a"), (24.0, "a")], 24.4, False),
        ([(20.0, "a")], 23.0, True),
        ([(20.0, "")], 23.0, True),
        ([(20.0, "a"), (24.0, "b")], 22.5, True),  # both runs hold something, of the first nothing came
        ([(20.0, "a"), (24.0, "")], 22.5, False),  # a tick does not say whose
        ([], 23.0, False),
    ],
)
def test_a_map_that_was_never_heard_and_died_with_its_node_is_said_to_be_lost(
    words: list[tuple[float, str]], began_mono_s: float, *, is_lost: bool
) -> None:
    for flies in (True, False):
        mirror = MapMirror("radar")
        mirror.on_flight(flies=flies)
        for t_mono_s, run in words:
            mirror.expect(t_mono_s, run)
        mirror.fold(delta([CRANE], whole=True, began_mono_s=began_mono_s))
        assert mirror.has_forgotten is (is_lost and flies), "on the ground nobody counts on it"
        assert kept_in(mirror) == {CRANE}
        mirror.fold(delta([], whole=True, began_mono_s=began_mono_s + 50.0))
        assert mirror.has_forgotten is (is_lost and flies), "what came is kept"
        mirror.dismiss(1)
        assert not mirror.has_forgotten


def test_what_was_waited_for_before_the_flight_is_not_lost_in_it() -> None:
    mirror = MapMirror("radar")
    mirror.expect(20.0, "a")
    mirror.on_flight(flies=True)
    mirror.fold(delta([CRANE], whole=True, began_mono_s=40.0))
    assert (mirror.has_forgotten, kept_in(mirror)) == (False, {CRANE})


def test_of_what_was_emptied_by_order_nothing_is_lost_however_late_its_node_answers() -> None:
    mirror = in_flight()
    mirror.dismiss(1)
    for t_mono_s, run in ((20.0, "a"), (21.0, "b")):
        mirror.expect(t_mono_s, run)
    mirror.fold(delta([CRANE], whole=True, began_mono_s=30.0, clear_count=1))
    assert (mirror.has_forgotten, kept_in(mirror)) == (False, {CRANE})


@pytest.mark.parametrize("how", ["another run says so", "another map is told"])
def test_what_was_seen_after_the_maps_were_emptied_and_died_unheard_is_said_to_be_lost(how: str) -> None:
    mirror = in_flight()
    mirror.dismiss(1)
    mirror.expect(20.0, "a", 0)
    mirror.expect(28.0, "a", 1)
    if how == "another run says so":
        mirror.expect(28.5, "b", 1)
    mirror.fold(delta([CRANE], whole=True, began_mono_s=31.0 if how == "another map is told" else 28.5, clear_count=1))
    assert (mirror.has_forgotten, kept_in(mirror)) == (True, {CRANE})
    mirror.dismiss(2)
    assert not mirror.has_forgotten, "the operator's way out"


def test_words_of_a_map_that_change_nothing_are_no_other_map() -> None:
    mirror = MapMirror("radar")
    mirror.on_flight(flies=True)
    before = mirror.folds
    folds = list[int]()
    for t_mono_s, run in ((10.0, "a"), (11.0, "a"), (12.0, ""), (13.0, "a"), (14.0, "b"), (15.0, "b"), (16.0, "c")):
        mirror.expect(t_mono_s, run)
        folds.append(mirror.folds - before)
    assert folds == [1, 1, 1, 1, 2, 2, 2], "something is missing; something is lost"
