"""Reads Hedgehop's own recordings: whole ones by their index, those of a killed recorder without it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from mcap.records import Attachment, Channel

from telemetry.errors import RecordingError
from telemetry.recording.file_types import foreign, is_mcap, opened
from telemetry.recording.mcap_files.chunks import BROKEN, chunk_content, messages, record_at, stream_of
from telemetry.recording.mcap_files.closing import ChunkPlace
from telemetry.recording.mcap_files.continuing import ABOUT
from telemetry.recording.mcap_files.scan import Contents, read_contents
from telemetry.recording.mcap_files.schemas import codec_of
from telemetry.recording.recorded_topics import RAW_ENCODING, raw_channel_topic
from telemetry.recording.tlog import Data
from telemetry.topics.messages import MESSAGE_TYPES, Published, RawFrame, Topic

UNFINISHED = "The recording was not finished: its recorder was killed, or is still recording."
_RAW_TOPICS = {raw_channel_topic(sent, spare): (sent, spare) for sent in (True, False) for spare in (True, False)}


def own_contents(name: str, data: Data, read: Callable[[Data], Contents]) -> Contents:
    """Raises RecordingError for other programs' files and for those that hold nothing."""
    try:
        contents = read(data)
    except BROKEN as error:
        what = "The recording was cut off before anything was recorded."
        raise RecordingError(what, where=name, advice="It can be deleted.") from error
    if not contents.library.startswith("hedgehop"):
        what = f"This MCAP file was not recorded by Hedgehop, but by {contents.library or 'an unknown program'}."
        raise RecordingError(what, where=name, advice="Choose a recording of Hedgehop or a .tlog.")
    if contents.end_ns == 0:
        raise RecordingError("The recording holds no messages.", where=name, advice="It can be deleted.")
    return contents


class Entry(NamedTuple):
    """A message, the topic it was published on and when the recorder got it."""

    t_utc_s: float
    topic: str
    message: Published


class Recording:
    """An opened recording; valid as long as ``data`` is."""

    def __init__(self, name: str, data: Data) -> None:
        """Raises RecordingError for other programs' files and for those that hold nothing."""
        self.name, self._data = name, data
        self._contents = contents = own_contents(name, data, read_contents)
        self.faults: list[str] = [] if contents.finished else [UNFINISHED]
        self.faults += [_gap(each) for each in contents.continued]
        self._topics = {number: _topic_of(channel) for number, channel in contents.channels.items()}
        self._places: dict[str, list[ChunkPlace]] = {}
        for chunk in contents.chunks:
            for topic in {self._topics.get(number) for number in chunk.channels} - {None}:
                self._places.setdefault(str(topic), []).append(chunk)

    @property
    def finished(self) -> bool:
        return self._contents.finished

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """By name, the last of each."""
        return self._contents.metadata

    @property
    def start_utc_s(self) -> float:
        return self._contents.start_ns / 1e9

    @property
    def end_utc_s(self) -> float:
        return self._contents.end_ns / 1e9

    @property
    def mono_minus_utc_s(self) -> float:
        """What turns the recording's times into its machine's monotonic clock of then."""
        about = self.metadata.get(ABOUT, {})
        try:
            return float(about["t_mono_s"]) - float(about["t_utc_s"])
        except (KeyError, ValueError):
            return 0.0

    def topics(self) -> frozenset[str]:
        return frozenset(self._places)

    def entries(self, topics: Collection[str], from_utc_s: float | None = None) -> Iterator[Entry]:
        """Messages of these topics from a time on, in the order in which they came."""
        from_ns = -1 if from_utc_s is None else round(from_utc_s * 1e9)
        for chunk in self._contents.chunks:
            if chunk.end_ns >= from_ns and any(self._topics.get(number) in topics for number in chunk.channels):
                yield from (e for e in self._chunk_entries(chunk, topics) if round(e.t_utc_s * 1e9) >= from_ns)

    def latest(self, topic: str, until_utc_s: float) -> Entry | None:
        """The last message of a topic up to a time, found without reading what lies between."""
        return next((entries[-1] for entries in self.backwards(topic, until_utc_s) if entries), None)

    def backwards(self, topic: str, until_utc_s: float) -> Iterator[list[Entry]]:
        """The messages of a topic up to a time, chunk by chunk, the newest chunk first."""
        until_ns = round(until_utc_s * 1e9)
        chunks = self._places.get(topic, [])
        for number in range(bisect_right(chunks, until_ns, key=lambda chunk: chunk.start_ns) - 1, -1, -1):
            entries = self._chunk_entries(chunks[number], (topic,))
            yield [entry for entry in entries if round(entry.t_utc_s * 1e9) <= until_ns]

    def attachment(self, name: str) -> bytes | None:
        """The file of that name that was put into this one."""
        index = self._contents.attachments.get(name)
        if index is None:
            return None
        try:
            record = record_at(self._data, index.offset, len(self._data))
            return Attachment.read(stream_of(self._data, record)).data
        except BROKEN as error:
            self._fault(f"A damaged part was left out: {error}.")
            return None

    def _chunk_entries(self, chunk: ChunkPlace, topics: Collection[str]) -> Iterator[Entry]:
        try:
            content = chunk_content(self._data, chunk)
        except BROKEN as error:
            self._fault(f"A damaged part was left out: {error}.")
            return
        for message in messages(content):
            topic = self._topics.get(message.channel)
            if topic is None or topic not in topics:
                continue
            try:
                decoded = self._decode(topic, message.channel, message.data, message.own_ns / 1e9)
            except RecordingError as error:
                self._fault(error.what)
                continue
            yield Entry(message.t_ns / 1e9, topic, decoded)

    def _decode(self, topic: str, number: int, data: bytes, own_utc_s: float) -> Published:
        if topic != Topic.RAW:
            return codec_of(MESSAGE_TYPES[topic]).decode(data)
        channel = self._contents.channels[number]
        sent, spare = _RAW_TOPICS[channel.topic]
        return RawFrame(own_utc_s, sent, channel.metadata.get("link", ""), data, spare)

    def _fault(self, text: str) -> None:
        """Each kind of fault once."""
        if text not in self.faults:
            self.faults.append(text)


def _gap(continued: dict[str, str]) -> str:
    try:
        from_s, until_s = float(continued["from_utc_s"]), float(continued["until_utc_s"])
        at = f"{datetime.fromtimestamp(from_s, UTC):%H:%M:%S} UTC"
    except (KeyError, ValueError, OverflowError):
        return "The recorder had died and was started again: for a while nothing was recorded."
    return f"Nothing was recorded for {until_s - from_s:.1f} s from {at}: the recorder had died and was started again."


def _topic_of(channel: Channel) -> str | None:
    """On the bus; None for channels that are not from there."""
    if channel.message_encoding == RAW_ENCODING:
        return Topic.RAW if channel.topic in _RAW_TOPICS else None
    return channel.topic if channel.topic in MESSAGE_TYPES else None


@contextmanager
def open_recording(path: Path) -> Iterator[Recording]:
    """Raises RecordingError for anything but a recording of Hedgehop."""
    with opened(path) as data:
        if not is_mcap(data):
            raise foreign(path, data)
        yield Recording(path.name, data)
