"""Maps over a bus that loses parts, of nodes that die: what counts is never less than what came, nor half of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from server.scene.mirror import MapMirror
from telemetry.topics.obstacles import MapDelta
from tests.server.obstacle_messages import delta

Key = tuple[int, int, int]
KEYS = st.tuples(st.integers(-40, 40), st.integers(-3, 3), st.integers(0, 3))
STEPS = st.one_of(
    st.tuples(st.just("sees"), st.sets(KEYS, min_size=1, max_size=4)),
    st.tuples(st.just("frees"), st.sets(KEYS, min_size=1, max_size=4)),
    st.tuples(st.just("tells again"), st.integers(1, 3)),
    st.tuples(st.just("dies"), st.just(0)),
    st.tuples(st.just("is emptied"), st.just(0)),
)


class Node:
    """Tells what it sees as ``ChangeTeller`` does."""

    def __init__(self) -> None:
        self.holds: set[Key] = set()
        self.revision, self.began_mono_s, self.clear_count = 0, 1.0, 0

    def tells(self, step: tuple[str, Any]) -> list[MapDelta]:
        what, value = step
        if what in ("dies", "is emptied"):
            self.holds, self.revision = set(), 0
            self.began_mono_s += 1.0
            self.clear_count += what == "is emptied"
            return self._whole(1)
        if what == "tells again":
            return self._whole(value)
        before, self.revision = self.revision, self.revision + 1
        self.holds = self.holds | value if what == "sees" else self.holds - value
        probability = 200 if what == "sees" else 20
        return [self._delta(sorted(value), probability, since=before)]

    def tells_of_before(self) -> MapDelta:
        """On its way since before the last order."""
        return replace(self._delta([(9, 9, 9)], 200, since=self.revision), clear_count=self.clear_count - 1)

    def _whole(self, parts: int) -> list[MapDelta]:
        keys = sorted(self.holds)
        return [self._delta(keys[k::parts], 200, whole=True, part=k, parts=parts) for k in range(parts)]

    def _delta(self, keys: list[Key], probability: int, **more: Any) -> MapDelta:
        told = {"revision": self.revision, "began_mono_s": self.began_mono_s, "clear_count": self.clear_count}
        return delta(keys, probability, **(told | more))


def keys_in(mirror: MapMirror) -> set[Key]:
    return {(x, y, z) for voxels in mirror.seen_so_far() for x, y, z in voxels.keys.tolist()}


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(STEPS, st.integers(0, 7)), max_size=25))
def test_nothing_is_lost_unsaid_whatever_the_bus_loses(steps: list[tuple[Any, int]]) -> None:
    node, mirror = Node(), MapMirror("radar")
    mirror.on_flight(flies=True)
    mirror.fold(node.tells(("tells again", 1))[0])
    came, before = set[Key](), set[Key]()
    """What of this map came whole last; what of maps whose nodes died since. A last word that is lost before its node
    dies is noticed by nobody."""
    for step, lost in steps:
        if step[0] == "dies":
            before, came = before | came, set()
        if step[0] == "is emptied":
            before, came = set(), set()
            mirror.dismiss(node.clear_count + 1)
            assert keys_in(mirror) == set()
        # The first word of another map comes sooner or later: here at once.
        lost = 0 if step[0] in ("dies", "is emptied") else lost
        parts = node.tells(step)
        for number, part in enumerate(parts):
            if not lost & (1 << number):
                mirror.fold(part)
        if node.clear_count:
            mirror.fold(node.tells_of_before())
        if lost & ((1 << len(parts)) - 1) == 0 and mirror.seen() is not None:
            came = set(node.holds)
            assert came <= keys_in(mirror)
        assert before <= keys_in(mirror) or mirror.has_forgotten
    for part in node.tells(("tells again", 2)):
        assert mirror.fold(part)
    assert mirror.is_complete
    assert node.holds <= keys_in(mirror)
    assert before <= keys_in(mirror) or mirror.has_forgotten
    assert (9, 9, 9) not in keys_in(mirror)
    mirror.on_flight(flies=False)
    assert keys_in(mirror) == node.holds
