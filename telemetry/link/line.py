"""One connection with its parsers: bytes in, messages with their source out, and a verdict on what comes."""

from __future__ import annotations

from collections.abc import Callable

from telemetry.errors import ConnectionFailedError
from telemetry.link.peers import Source
from telemetry.mavlink.actions import Message
from telemetry.mavlink.address import Address
from telemetry.mavlink.codec import Packer, Parser
from telemetry.mavlink.connections import Connection, Peer, Receiver, make_connection
from telemetry.topics.messages import ConnectionStatus, ErrorInfo

MOST_PARSERS = 64
JUDGE_S = 3.0
JUNK_BYTES = 300
"""So many bytes without one message mean another baud rate or another protocol."""


class Line:
    def __init__(
        self,
        address: Address,
        *,
        heard: Callable[[Line, Source, Message], None],
        gone: Callable[[Line, Peer], None],
        changed: Callable[[], None],
        clock: Callable[[], float],
        seal: Callable[[Line, Peer, bytes], bytes],
        number: int,
    ) -> None:
        """``number``: of this link in signatures; ``seal``: signs a frame to a peer that has a key."""
        self.address, self.text = address, address.text
        self._heard, self._gone, self._clock = heard, gone, clock
        self.number, self._seal = number, seal
        self._packer = Packer()
        self._parsers: dict[Peer, Parser] = {}
        self._bad_of_the_past = self.received_messages = 0
        self._bytes_without_message = 0
        self._message_s = clock()
        self.connection: Connection = make_connection(address, Receiver(self._received, self._peer_gone, changed))

    def send(self, message: Message, peer: Peer | None = None) -> bytes | None:
        """The frame that was sent; None when it could not be. ``peer`` None: the far end that the address names."""
        frame = self._packer.pack(message)
        if peer is not None:
            frame = self._seal(self, peer, frame)
        return frame if self.connection.send(frame, peer) else None

    @property
    def bad_bytes(self) -> int:
        return self._bad_of_the_past + sum(parser.bad_bytes for parser in self._parsers.values())

    def status(self) -> ConnectionStatus:
        error = self.connection.error or self._judgement()
        waiting = "open" if self.received_messages else "waiting"
        failed = self.connection.state == "failed" and self.connection.error is not None
        return ConnectionStatus(
            address=self.text,
            state="failed" if failed else waiting,
            error=error and ErrorInfo.of(error),
            received_messages=self.received_messages,
            bad_bytes=self.bad_bytes,
        )

    def _received(self, peer: Peer, data: bytes) -> None:
        messages = self._parser(peer).feed(data)
        self.received_messages += len(messages)
        self._bytes_without_message += len(data)
        if messages:
            self._bytes_without_message, self._message_s = 0, self._clock()
        for message in messages:
            self._heard(self, Source(self.text, peer, message.get_srcSystem(), message.get_srcComponent()), message)

    def _parser(self, peer: Peer) -> Parser:
        parser = self._parsers.pop(peer, None) or Parser(datagrams=self.connection.datagrams)
        self._parsers[peer] = parser
        if len(self._parsers) > MOST_PARSERS:
            self._forget(next(iter(self._parsers)))
        return parser

    def _peer_gone(self, peer: Peer) -> None:
        self._forget(peer)
        self._gone(self, peer)

    def _forget(self, peer: Peer) -> None:
        parser = self._parsers.pop(peer, None)
        self._bad_of_the_past += parser.bad_bytes if parser else 0

    def _judgement(self) -> ConnectionFailedError | None:
        """Bytes come, but no message: what is the cause?"""
        if self._bytes_without_message < JUNK_BYTES or self._clock() - self._message_s < JUDGE_S:
            return None
        if self.address.kind == "serial":
            return ConnectionFailedError(
                f"Bytes come in at {self.address.baud} baud, but no MAVLink message is among them.",
                where=self.text,
                advice="Try another baud rate (57600, 115200, 921600), or another of the vehicle's ports.",
            )
        return ConnectionFailedError(
            "Bytes come in, but no MAVLink message is among them.",
            where=self.text,
            advice="Something else sends to this port: check what the other side is.",
        )
