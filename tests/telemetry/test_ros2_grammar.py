"""Keys, tokens, attachments and hashes of rmw_zenoh; addresses that are reached; clocks, frames and the inbox."""

from __future__ import annotations

import random
import struct
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import Ros2AddressError
from telemetry.recording.ros.ros2_messages import Ros2Messages
from telemetry.recording.ros.transforms import Gap, Transform
from telemetry.ros2 import grammar
from telemetry.ros2.graph import Graph
from telemetry.ros2.listener import Inbox
from telemetry.ros2.message_times import MOST_BEHIND_S, SessionClocks, StampClock
from telemetry.ros2.robot_frames import FrameError, LiveTransforms
from telemetry.ros2.topic_faults import MOST_REASONS, OVER_S, Words
from telemetry.ros2.wire import WireSample
from telemetry.ros2.zenoh_endpoint import zenoh_address

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
TALKER = (
    "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/"
    f"{STRING_HASH}/::,7:,:,:,,"
)
"""As rmw_zenoh's own design text shows it."""
names = st.from_regex(r"/[a-z][a-z0-9_]{0,8}(/[a-z][a-z0-9_]{0,8}){0,3}", fullmatch=True)
NOTHING = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


def test_the_token_of_the_design_text_is_read() -> None:
    found = grammar.read_token(TALKER)
    assert found is not None
    assert (found.node, found.key.topic, found.key.type) == ("/talker", "/chatter", "std_msgs/msg/String")
    assert (found.key.hash, found.keeps, found.depth) == (STRING_HASH, False, 7)
    assert str(found.key) == f"0/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
    assert grammar.read_token("@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener") is None


def test_hashes_are_those_that_ros_2_itself_tells() -> None:
    messages = Ros2Messages()
    assert messages.hash_of("std_msgs/msg/String") == STRING_HASH
    for kind, digest in (
        ("sensor_msgs/msg/PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"),
        ("tf2_msgs/msg/TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
    ):
        assert messages.hash_of(kind) == f"RIHS01_{digest}"


@given(names, st.integers(0, 232), st.booleans(), st.integers(1, 1000))
def test_what_is_written_is_read(topic: str, domain: int, keeps: bool, depth: int) -> None:
    key = grammar.DataKey(domain, topic, "nav_msgs/msg/Odometry", grammar.NO_HASH)
    assert grammar.read_key(str(key)) == key
    endpoint = grammar.Endpoint("MP", "ab12", "/hedgehop", "3", key, keeps, depth)
    assert grammar.read_token(grammar.endpoint_token(endpoint)) == endpoint


@given(st.integers(-(2**63), 2**63 - 1), st.integers(0, 2**63 - 1), st.binary(min_size=16, max_size=16))
def test_attachments(sequence: int, source_ns: int, gid: bytes) -> None:
    """Two numbers of 64 bits and an array with its length before it, as zenoh-cpp serializes them."""
    packed = grammar.Attachment(sequence, source_ns, gid).packed()
    assert packed == struct.pack("<qq", sequence, source_ns) + b"\x10" + gid
    assert grammar.read_attachment(packed) == grammar.Attachment(sequence, source_ns, gid)


def test_a_publishers_name_is_the_hash_of_its_token() -> None:
    """XXH3's own example: of nothing, 128 bits are 99aa06d3014798d86001c324468d497f."""
    assert grammar.gid_of("") == bytes.fromhex("99aa06d3014798d86001c324468d497f")[::-1]


def test_a_thousand_mutants_are_refused_or_read_and_nothing_else() -> None:
    draw, refused = random.Random(4), 0
    pieces = ["", "/", "%", ":", ",", "*", "\x00", "é", "9" * 40, "²"]
    graph = Graph()
    for _ in range(1000):
        text = list(TALKER)
        for _ in range(draw.randint(1, 6)):
            place = draw.randrange(len(text))
            text[place : place + draw.randint(0, 3)] = draw.choice(pieces)
        for read in (grammar.read_token, grammar.read_key):
            try:
                read("".join(text))
            except grammar.GrammarError:
                refused += 1
        graph.on_token("".join(text), True)
        beside = draw.randbytes(draw.choice([0, 1, 32, 33, 34, 100]))
        try:
            grammar.read_attachment(beside)
        except grammar.GrammarError:
            refused += 1
    assert refused > 1500
    assert graph.refused["tokens"] > 300


def test_a_number_is_written_in_ascii() -> None:
    with pytest.raises(grammar.GrammarError):
        grammar.read_token(TALKER.replace(",7:", ",²:"))
    with pytest.raises(grammar.GrammarError):
        grammar.read_token(TALKER.replace("lv/0/", "lv/²/"))


def test_only_ones_own_nets_are_reached() -> None:
    assert zenoh_address("localhost").endpoint == "tcp/127.0.0.1:7447"
    assert zenoh_address("tcp/10.0.0.7:7448").endpoint == "tcp/10.0.0.7:7448"
    assert zenoh_address("[fe80::1]:7447", is_peer=True).mode == "peer"
    for wrong in ("8.8.8.8", "robot.example", "udp/10.0.0.7:7447", "0.0.0.0", "224.0.0.224", "10.0.0.7:0", "10.0.0.7:x",
                  "", "tcp/", "10.0.0.7#iface=eth0", "[2001:4860::1]:7447", "tcp/10.0.0.7:7447?rel=0"):  # fmt: skip
        with pytest.raises(Ros2AddressError):
            zenoh_address(wrong)


@given(st.floats(-1e5, 1e5), st.lists(st.floats(0.0, 0.4), min_size=1, max_size=40))
def test_a_frame_is_never_younger_than_the_shortest_way_makes_it(offset_s: float, delays: list[float]) -> None:
    """Whatever the publisher's clock: what was measured is placed late by the shortest delay at most."""
    clock, shortest_s = StampClock(), 1.0
    for number, delay_s in enumerate(delays):
        true_s = 1e6 + number
        source_s = true_s - offset_s
        measured = clock.on_message(
            stamp_ns=round((source_s - 0.05) * 1e9), source_ns=round(source_s * 1e9),
            received_mono_s=number + delay_s, received_utc_s=true_s + delay_s,
        )  # fmt: skip
        shortest_s = min(shortest_s, delay_s)
        assert not measured.is_odd
        assert measured.t_mono_s == pytest.approx(number - 0.05 + shortest_s, abs=1e-4)


def test_stamps_of_another_clock_count_as_published() -> None:
    clock = StampClock()
    for stamp_ns in (5_000_000_000, 2_000_000_000_000, round(1e15 + 1e9), round(1e15 - (MOST_BEHIND_S + 0.1) * 1e9)):
        found = clock.on_message(stamp_ns=stamp_ns, source_ns=10**15, received_mono_s=7.0, received_utc_s=1e6 + 0.01)
        assert found.is_odd
        assert found.t_mono_s == pytest.approx(7.0)


def test_our_own_clock_of_day_may_step() -> None:
    clock = StampClock()
    for second, step_s in ((0, 0.0), (1, 3600.0), (2, -3600.0)):
        found = clock.on_message(
            stamp_ns=0, source_ns=10**15 + second * 10**9, received_mono_s=second, received_utc_s=1e6 + second + step_s
        )
        assert found.t_mono_s == pytest.approx(second, abs=1e-5)
        assert clock.offset_s == pytest.approx(step_s, abs=1e-5)


def test_a_clock_that_is_set_back_is_learnt_anew() -> None:
    clock = StampClock()
    clock.on_message(stamp_ns=0, source_ns=10**15, received_mono_s=1.0, received_utc_s=1e6)
    found = clock.on_message(stamp_ns=0, source_ns=10**15 - 10**10, received_mono_s=2.0, received_utc_s=1e6 + 1)
    assert found.t_mono_s == pytest.approx(2.0)
    assert clock.offset_s == pytest.approx(11.0)


def heard_late(clock: StampClock, received_s: float, late_s: float, gid: bytes = b"") -> float:
    """How old a message counts that was published ``late_s`` before it was received, by a clock 1e6 s ahead."""
    source_ns = round((1e6 + received_s - late_s) * 1e9)
    found = clock.on_message(
        stamp_ns=0, source_ns=source_ns, received_mono_s=received_s, received_utc_s=2e6 + received_s, gid=gid
    )
    return received_s - found.t_mono_s


@pytest.mark.parametrize("silence_s", [11.0, 29.0, 31.0, 600.0])
def test_what_comes_late_after_a_silence_is_as_old_as_it_is(silence_s: float) -> None:
    clock = StampClock()
    for second in range(40):
        heard_late(clock, second, 0.01)
    for place in range(20):
        assert heard_late(clock, 40.0 + silence_s + place, 10.0) == pytest.approx(9.99, abs=0.07)
    # All agree: the publisher's clock was set back meanwhile.
    ages = [heard_late(clock, 40.0 + silence_s + place, 10.0) for place in range(20, 60)]
    assert ages[-1] == pytest.approx(0.0, abs=1e-6)


def test_a_lone_message_now_and_then_undoes_nothing() -> None:
    clock = StampClock()
    heard_late(clock, 0.0, 0.01)
    ages = [heard_late(clock, 40.0 * number, 10.0) for number in range(1, 60)]
    assert min(ages) > 9.5


def test_one_session_has_one_clock_by_its_shortest_way() -> None:
    sessions = {b"pose": "robot", b"cloud": "robot"}
    clocks = SessionClocks(lambda topic, gid: sessions.get(gid))
    assert heard_late(clocks.of("/points", b"cloud"), 1.0, 0.05, b"cloud") == pytest.approx(0.0, abs=1e-6)
    assert heard_late(clocks.of("/odom", b"pose"), 1.1, 0.002, b"pose") == pytest.approx(0.0, abs=1e-6)
    assert heard_late(clocks.of("/points", b"cloud"), 1.2, 0.05, b"cloud") == pytest.approx(0.048, abs=1e-6)
    # A cloud that is seconds behind the poses is no clock that was set back.
    assert heard_late(clocks.of("/points", b"cloud"), 3.0, 1.5, b"cloud") == pytest.approx(1.498, abs=1e-6)
    assert heard_late(clocks.of("/other", b"else"), 3.0, 9.0, b"else") == pytest.approx(
        0.0, abs=1e-6
    )  # another machine's
    sessions.clear()  # its tokens are gone; what was on the way comes still
    assert heard_late(clocks.of("/points", b"cloud"), 3.1, 1.5, b"cloud") == pytest.approx(1.498, abs=1e-6)


def test_a_publishers_session_is_that_of_its_token() -> None:
    graph = Graph()
    graph.on_token(TALKER, True)
    session = TALKER.split("/")[2]
    assert graph.session_of("/other", grammar.gid_of(TALKER)) == session
    assert graph.session_of("/chatter", b"x") == session  # nobody else publishes it
    graph.on_token(TALKER.replace(session, "ab"), True)
    assert graph.session_of("/chatter", b"x") is None
    graph.on_token(TALKER, False)
    assert graph.session_of("/other", grammar.gid_of(TALKER)) is None


def test_a_subscription_of_another_definition_is_none_of_the_topics() -> None:
    graph = Graph()
    graph.on_token(TALKER, True)
    graph.on_token(TALKER.replace("/MP/", "/MS/").replace(STRING_HASH, "RIHS01_" + "0" * 64), True)
    (found,) = graph.topics()
    assert (found.hashes, found.subscriptions) == ((STRING_HASH,), 1)


def test_ways_between_frames_of_now() -> None:
    tree = LiveTransforms()
    tree.add("base", "mast", 0, np.array([0.0, 0.0, 1.0]), NOTHING[1], is_static=True)
    tree.add("mast", "lidar", 0, np.array([1.0, 0.0, 0.0]), NOTHING[1], is_static=True)
    assert tree.at("odom", "lidar", 5, 10**9) is None
    for second in range(30):
        tree.add("odom", "base", second * 10**9, np.array([float(second), 0.0, 0.0]), NOTHING[1], is_static=False)
    way = tree.at("odom", "lidar", 25_500_000_000, 2 * 10**9)
    assert isinstance(way, Transform)
    assert way(np.zeros((1, 3))) == pytest.approx(np.array([[26.5, 0.0, 1.0]]))
    assert isinstance(tree.at("odom", "lidar", 5_500_000_000, 2 * 10**9), Gap)  # forgotten
    assert isinstance(tree.at("odom", "lidar", 29_500_000_000, 2 * 10**9), Gap)  # not there yet
    assert isinstance(tree.at("odom", "lidar", 25_500_000_000, 10**8), Gap)  # too long a gap
    for parent, child, why in (("lidar", "mast", "two parents"), ("lidar", "odom", "circle"), ("x", "x", "circle")):
        with pytest.raises(FrameError, match=why):
            tree.add(parent, child, 0, *NOTHING, is_static=True)
    # What is fixed stays fixed, and what moves may turn out to be fixed.
    with pytest.raises(FrameError, match="fixed by /tf_static"):
        tree.add("mast", "lidar", 25 * 10**9, *NOTHING, is_static=False)
    tree.add("odom", "base", 0, np.array([7.0, 0.0, 0.0]), NOTHING[1], is_static=True)
    way = tree.at("odom", "lidar", 99 * 10**9, 10**8)
    assert isinstance(way, Transform)
    assert way(np.zeros((1, 3))) == pytest.approx(np.array([[8.0, 0.0, 1.0]]))


def test_who_is_slow_loses_the_oldest_and_nobody_waits() -> None:
    inbox = Inbox({"tf": 3, "points": 2})
    samples = [WireSample(str(n), b"", b"", 0, 0.0, 0.0) for n in range(5)]
    for sample in samples:
        inbox.put("points", sample)
    inbox.put("tf", samples[0])
    taken = [inbox.take(0.0) for _ in range(4)]
    assert [(row, sample.key) for row, sample in filter(None, taken)] == [("tf", "0"), ("points", "3"), ("points", "4")]
    assert inbox.dropped == {"tf": 0, "points": 3}
    for _ in range(2):
        inbox.put("tf", samples[0])
        inbox.put("points", samples[1])
    turns = [inbox.take(0.0) for _ in range(4)]
    assert {row for row, _ in filter(None, turns[:2])} == {"tf", "points"}  # a flood of one does not starve the other
    waiting = threading.Timer(0.05, inbox.put, ("tf", samples[1]))
    waiting.start()
    assert inbox.take(30.0) == ("tf", samples[1])
    waiting.join()


def test_words_are_said_once_and_at_the_pace_that_a_pilot_is_told() -> None:
    said: list[str] = []
    now_s = [0.0]
    words = Words(tell=said.append, now=lambda: now_s[0])
    for _ in range(5):
        words.begins("router", "The router is gone.", "It is tried again.")
    words.ends("router", "The router is back.")
    words.ends("router", "The router is back.")
    assert said == ["The router is gone. It is tried again.", "The router is back."]
    due = []
    for now_s[0] in (0.0, 0.5, 1.0, 1.2, 5.0):
        due += [(now_s[0], word.text) for word in words.due()]
    assert due == [(0.0, "The router is gone."), (1.2, "The router is back.")]


def test_each_reason_is_said_and_over_when_it_has_not_come_again() -> None:
    said: list[str] = []
    now_s = [0.0]
    words = Words(tell=said.append, now=lambda: now_s[0])
    for _ in range(3):
        words.recurs("/points", "bad fields", "Mend it.")
        words.recurs("/points", "bad size")
    assert said == ["bad fields Mend it.", "bad size"]
    now_s[0] = OVER_S - 1.0
    words.recurs("/points", "bad size")
    now_s[0] = OVER_S
    list(words.due())
    assert words.held == ["bad size"]
    assert said[2:] == ["No more: bad fields"]
    for number in range(50):
        words.recurs("/points", f"reason {number}")
    assert len(words.held) == MOST_REASONS + 1
    assert said[-1] == "/points: for further reasons, too."
    words.ends("/points", "fine")
    assert words.held == []
