"""The parts of following: echoes that are one thing, approaches with their hysteresis, what is proposed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.poses import Pose
from mapping.radar.targets import Polar
from mapping.tracking.blobs import MOST_BLOBS, SAME_M, Blobs, blobs
from mapping.tracking.tracker_params import TrackState
from planning.evading.velocity_obstacles import Limits, Obstacles, approaches
from planning.missions.vehicle_profile import dump_profile, load_profile
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.tracking.approach import BEGIN_FRAMES, OUT_S, ApproachBook, words
from telemetry.tracking.evasion import MOST_CONES, Rules, evasion
from telemetry.tracking.followed import ENOUGH_UPDATES, Followed, Keep, TrackMemory
from telemetry.tracking.object_tracking import USUAL, limits_of
from tests.telemetry import perception_flights as flights

NORTHWARDS = Pose(100.0, np.array([0.0, 0.0, 10.0]), np.array([0.0, 3.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
RADIUS_M, WITHIN_S = 3.0, 8.0
STANDS_M, STANDS_S = 2.0, 5.0
KEEP = Keep(RADIUS_M, WITHIN_S, STANDS_M, STANDS_S)
RULES = Rules(KEEP, USUAL)


def state(
    place: tuple[float, float], velocity: tuple[float, float], *, number: int = 1, sigma_m_s: float = 0.2, **of: float
) -> TrackState:
    spread = np.diag([0.25, 0.25, sigma_m_s**2, sigma_m_s**2])
    seen = {"age_s": 5.0, "updates": 40} | of
    return TrackState(
        number, np.array(place), np.array(velocity), spread, seen["age_s"], int(seen["updates"]), True, True
    )


def followed(
    place: tuple[float, float], velocity: tuple[float, float], *, moving: bool = True, **of: float
) -> Followed:
    one = state(place, velocity, **of)  # type: ignore[arg-type]
    coming = approaches(Obstacles.of([0.0, 0.0], [place], [velocity], radius_m=0.0), [0.0, 3.0])
    return Followed(one, moving, np.array(place), float(coming.closest_m[0]), float(coming.after_s[0]))


def told(*things: tuple[float, float, float, float, bool]) -> Blobs:
    """Range, azimuth in degrees, radial speed, strength, and whether it moves."""
    r, a, v, s, m = (np.array(column) for column in zip(*things, strict=True))
    return blobs(Polar(r, np.radians(a), np.zeros(len(r))), v, s, m.astype(np.bool_))


def test_echoes_of_one_body_are_one_thing_where_most_of_its_power_is() -> None:
    found = told((30.0, 0.0, -4.0, 40.0, True), (31.0, 1.0, -4.0, 20.0, True), (30.0, 1.0, 0.0, 30.0, False))
    assert len(found) == 2
    assert found.range_m[0] == pytest.approx(30.0, abs=0.05)
    assert found.moving.tolist() == [True, False]
    assert found.detections.shape == (2, 3)


def test_nothing_in_a_frame_is_nothing() -> None:
    none = np.empty(0)
    assert len(blobs(Polar(none, none, none), none, none, np.empty(0, np.bool_))) == 0


@settings(deadline=None)
@given(st.integers(0, 400), st.integers(0, 2**32 - 1))
def test_blobs_are_apart_bounded_and_inside_of_what_was_seen(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    r, a = random.uniform(2.0, 100.0, count), random.uniform(-0.7, 0.7, count)
    v, m = random.choice([-4.0, 0.0], count), random.random(count) < 0.3
    found = blobs(Polar(r, a, np.zeros(count)), v, random.uniform(10, 50, count), m)
    assert len(found) <= min(count, MOST_BLOBS)
    assert count == 0 or len(found) > 0
    if len(found):
        assert found.range_m.max() <= 100.0 + SAME_M
        assert set(np.round(found.radial_speed_m_s, 6)) <= {-4.0, 0.0}
        assert np.all(np.diff(found.moving.astype(int)) <= 0)


def test_what_is_seen_too_seldom_or_comes_too_late_or_passes_is_not_dangerous() -> None:
    assert followed((0.0, 40.0), (0.0, -4.0)).is_dangerous(KEEP)
    assert not followed((0.0, 40.0), (0.0, -4.0), updates=ENOUGH_UPDATES - 1).is_dangerous(KEEP)
    assert not followed((0.0, 60.0), (0.0, -4.0)).is_dangerous(KEEP)
    assert not followed((4.0, 40.0), (0.0, -4.0)).is_dangerous(KEEP)
    assert not replace(followed((0.0, 40.0), (0.0, -4.0)), unseen_s=1.0).is_dangerous(KEEP)
    assert followed((1.0, -1.0), (0.0, 0.0)).is_dangerous(KEEP)


@pytest.mark.parametrize(
    ("velocity", "sigma_m_s", "echo_moves", "moves"),
    [
        ((0.0, -4.0), 0.3, True, True),
        ((0.0, -4.0), 0.3, False, False),
        ((0.0, -4.0), 3.0, True, False),
        ((0.0, -0.3), 0.01, True, False),
    ],
)
def test_it_moves_only_by_more_than_chance_and_when_its_echoes_bear_it_out(
    velocity: tuple[float, float], sigma_m_s: float, echo_moves: bool, moves: bool
) -> None:
    memory, echo = TrackMemory(), told((40.0, 0.0, -7.0, 40.0, echo_moves))
    seen = [memory.observe([state((0.0, 40.0), velocity, sigma_m_s=sigma_m_s)], echo, NORTHWARDS) for _ in range(5)]
    assert [one.moving for one in seen[-1]] == [moves]


class Book:
    """An approach book, frame by frame."""

    def __init__(self) -> None:
        self.book, self.t_s = ApproachBook("approach-test", 1e9), 100.0

    def frame(self, *seen: Followed) -> list[ObstacleAlert]:
        self.t_s += 0.1
        return self.book.observe(
            seen,
            heading_rad=0.0,
            keep=KEEP,
            t_mono_s=self.t_s,
            done_t_mono_s=self.t_s + 0.02,
        )


NOT_ANY_MORE = "Moving object: not on a collision course any more"
OUT_OF_SIGHT = "Moving object no longer in sight: look out, last 40 m ahead"
COMING, BESIDE, PASSING = (followed((east, 40.0), (0.0, -4.0)) for east in (0.0, 4.0, 9.0))


def test_an_approach_begins_after_a_few_frames_and_is_told_once_a_second() -> None:
    book = Book()
    events = [event for _ in range(25) for event in book.frame(COMING)]
    assert [e.phase for e in events] == ["begins", "goes_on", "goes_on"]
    assert events[0].t_mono_s == pytest.approx(100.0 + 0.1 * BEGIN_FRAMES)
    assert events[0].t_utc_s - events[0].t_mono_s == pytest.approx(1e9)
    assert len({e.id for e in events}) == 1


def test_a_single_estimate_begins_nothing() -> None:
    book = Book()
    assert [e for k in range(30) for e in book.frame(COMING if k % 3 else PASSING)] == []
    unseen = replace(COMING, state=replace(COMING.state, seen=False))
    assert [e for _ in range(9) for e in book.frame(unseen)] == []


def test_at_the_edge_it_goes_on_and_ends_once_it_stays_out() -> None:
    book = Book()
    for _ in range(5):
        book.frame(COMING)
    assert all(e.phase == "goes_on" for k in range(30) for e in book.frame(BESIDE if k % 2 else COMING))
    events = [e for _ in range(round(OUT_S / 0.1) + 2) for e in book.frame(PASSING)]
    assert [(e.phase, e.text) for e in events] == [("ends", NOT_ANY_MORE)]
    assert book.book.end_all(200.0, 200.0, "Why") == []


@pytest.mark.parametrize(
    ("seen_s", "unseen_s", "text"),
    [(0.0, 1.6, "out of sight"), (0.4, 1.2, "out of sight"), (1.1, 0.5, "not any more")],
)
def test_it_ends_with_not_any_more_only_when_that_was_seen_just_before(
    seen_s: float, unseen_s: float, text: str
) -> None:
    book = Book()
    for _ in range(5):
        book.frame(COMING)
    guessed = replace(PASSING, state=replace(PASSING.state, seen=False))
    events = [e for _ in range(round(seen_s / 0.1)) for e in book.frame(PASSING)]
    events += [e for _ in range(round(unseen_s / 0.1)) for e in book.frame(guessed)]
    assert [e.phase for e in events] == ["ends"]
    last = OUT_OF_SIGHT if seen_s == 0.0 else OUT_OF_SIGHT.replace("40 m", "41 m")
    assert events[0].text == {"out of sight": last, "not any more": NOT_ANY_MORE}[text]


def test_what_ends_for_another_reason_says_which() -> None:
    book = Book()
    for _ in range(5):
        book.frame(COMING)
    assert [(e.phase, e.text) for e in book.book.end_all(200.0, 200.0, "Why")] == [("ends", "Why")]


def test_what_is_lost_ends_too_and_the_next_approach_has_another_id() -> None:
    book = Book()
    first = [e for _ in range(5) for e in book.frame(COMING)]
    ended = book.book.pass_time(book.t_s + OUT_S, book.t_s + OUT_S)
    assert [(e.phase, e.text) for e in ended] == [("ends", OUT_OF_SIGHT)]
    book.t_s += 5.0
    second = [e for _ in range(5) for e in book.frame(COMING)]
    assert first[0].id != second[0].id


@pytest.mark.parametrize(
    ("place", "where"),
    [
        ((0.0, 38.0), "ahead"),
        ((33.0, 19.0), "at 2 o'clock"),
        ((-38.0, 0.0), "at 9 o'clock"),
        ((0.0, -38.0), "at 6 o'clock"),
    ],
)
def test_its_words(place: tuple[float, float], where: str) -> None:
    one = replace(followed(place, (0.0, 0.0)), closest_m=1.84, closest_in_s=6.23)
    assert words(one, 0.0) == f"Moving object 38 m {where}, closest 1.8 m in 6.2 s"


def test_cones_are_of_the_nearest_and_bounded() -> None:
    many = [followed((0.0, 5.0 + k), (0.0, -4.0), number=k) for k in range(30)]
    found = evasion(many, NORTHWARDS, RULES)
    assert [cone.track_id for cone in found.cones] == list(range(MOST_CONES))
    first = found.cones[0]
    assert first.apex_enu_m_s == (0.0, -4.0)
    assert first.axis_deg == pytest.approx(0.0)
    assert first.half_angle_deg == pytest.approx(math.degrees(math.asin(RADIUS_M / 5.0)))


def test_inside_the_radius_every_velocity_that_comes_nearer_is_forbidden() -> None:
    found = evasion([followed((0.0, 2.0), (0.0, 0.0))], NORTHWARDS, RULES)
    assert found.cones[0].half_angle_deg == 90.0
    assert found.proposal is not None
    assert found.proposal.velocity_enu_m_s[1] < 0.0


def test_what_is_proposed_keeps_clear_of_everything_and_is_said_in_words() -> None:
    things = [followed((0.0, 40.0), (0.0, -4.0)), followed((4.5, 15.0), (0.0, 0.0), moving=False, number=2)]
    found = evasion(things, NORTHWARDS, Rules(KEEP, Limits(max_speed_m_s=5.0))).proposal
    assert found is not None
    places, velocities = [(0.0, 40.0), (4.5, 15.0)], [(0.0, -4.0), (0.0, 0.0)]
    coming = approaches(Obstacles.of([0.0, 0.0], places, velocities, radius_m=0.0), found.velocity_enu_m_s)
    assert coming.closest_m.min() >= RADIUS_M
    assert found.text.startswith("Turn ")
    assert "left" in found.text
    assert found.hold_s >= 1.0


def test_a_pole_dead_ahead_is_alerted_and_gives_a_way_past_it() -> None:
    pole = followed((0.2, 10.0), (0.0, 0.0), moving=False)
    book = Book()
    events = [event for _ in range(5) for event in book.frame(pole)]
    assert [event.phase for event in events] == ["begins"]
    assert events[0].text.startswith("Standing object 10 m ahead, closest 0.2 m in 3.3 s")
    found = evasion([pole], NORTHWARDS, RULES).proposal
    assert found is not None
    coming = approaches(Obstacles.of([0.0, 0.0], [(0.2, 10.0)], [(0.0, 0.0)], radius_m=0.0), found.velocity_enu_m_s)
    assert coming.closest_m[0] >= STANDS_M
    assert "left" in found.text  # its nearer edge: the pole is a little to the right


def test_a_speed_that_chance_accounts_for_does_not_move_a_pole_out_of_the_way() -> None:
    pole = followed((0.0, 10.0), (0.6, 0.0), moving=False, sigma_m_s=0.5)
    assert pole.velocity_enu_m_s.tolist() == [0.0, 0.0]
    assert followed((0.0, 10.0), (0.6, 0.0), sigma_m_s=0.1).velocity_enu_m_s.tolist() == [0.6, 0.0]


@pytest.mark.parametrize("place", [(0.0, 40.0), (4.0, 10.0), (0.0, -10.0)])
def test_nothing_is_proposed_for_what_stands_far_away_or_beside_or_behind(place: tuple[float, float]) -> None:
    found = evasion([followed(place, (0.0, 0.0), moving=False)], NORTHWARDS, RULES)
    assert found.proposal is None
    assert found.why_none == ""


def test_nothing_is_proposed_for_what_goes_past() -> None:
    found = evasion([PASSING], NORTHWARDS, RULES)
    assert found.proposal is None
    assert found.why_none == ""


def test_a_proposal_does_not_lead_into_rising_ground() -> None:
    pole = followed((0.2, 10.0), (0.0, 0.0), moving=False)
    west = tuple(6.0 if 90 <= k <= 119 else 40.0 for k in range(120))
    found = evasion([pole], NORTHWARDS, replace(RULES, room_m=west)).proposal
    assert found is not None
    assert "right" in found.text


def test_why_there_is_no_proposal_is_said() -> None:
    around = [
        followed((2.0 * math.sin(a), 2.0 * math.cos(a)), (0.0, 0.0), number=k)
        for k, a in enumerate(np.linspace(0.0, 2 * math.pi, 12, endpoint=False).tolist())
    ]
    found = evasion(around, NORTHWARDS, RULES)
    assert found.proposal is None
    assert "Every velocity" in found.why_none


def test_limits_are_those_of_the_plan_on_board() -> None:
    plan = flights.mission()
    toml = dump_profile(replace(load_profile("generic-quad"), mean_speed_m_s=6.0, max_speed_m_s=9.0))
    assert limits_of(replace(plan, profile_toml=toml)).max_speed_m_s == 9.0
    assert limits_of(replace(plan, profile_toml="")) == USUAL
    assert limits_of(replace(plan, profile_toml="no TOML [")) == USUAL
