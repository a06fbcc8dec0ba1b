"""What is recorded: everything, and every kind of message knows how."""

from __future__ import annotations

from telemetry.bus.encoding import EACH_ARRIVES
from telemetry.recording.mcap_files.schemas import codec_of
from telemetry.recording.recorded_topics import EVENTS, LATEST, NOT_RECORDED, RECORDED, raw_channel_topic
from telemetry.topics.messages import MESSAGE_TYPES, REPLAY_PREFIX, Topic


def test_every_topic_is_recorded_or_left_out_on_purpose() -> None:
    assert set(Topic) == RECORDED | NOT_RECORDED
    assert RECORDED == LATEST | EVENTS
    assert not any(topic.startswith(REPLAY_PREFIX) for topic in RECORDED)


def test_what_arrives_one_by_one_on_the_bus_is_an_event_here() -> None:
    assert EACH_ARRIVES <= EVENTS


def test_every_recorded_message_has_a_schema() -> None:
    names = {codec_of(MESSAGE_TYPES[topic]).schema_name for topic in RECORDED}
    assert len(names) == len({MESSAGE_TYPES[topic] for topic in RECORDED})


def test_directions_have_channels_of_their_own() -> None:
    topics = {raw_channel_topic(sent, spare) for sent in (True, False) for spare in (True, False)}
    assert len(topics) == 4
