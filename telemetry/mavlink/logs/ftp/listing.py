"""Listing a folder of a vehicle, sans-IO: a few names with each answer, until it says that there are no more."""

from __future__ import annotations

from dataclasses import dataclass

from telemetry.errors import RefusedError, SilentError, TelemetryError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message
from telemetry.mavlink.logs.ftp.payload import FtpPayload, Nak, Opcode
from telemetry.mavlink.logs.ftp.questions import SILENT_S, Numbers, Questions, as_path
from telemetry.mavlink.logs.on_the_ground import armed_meanwhile
from telemetry.topics.vehicle import VehicleState

MOST_ENTRIES = 4096
LONGEST_S = 30.0
_OWN_AND_ABOVE = (".", "..")


@dataclass(frozen=True, slots=True)
class FtpEntry:
    name: str
    is_folder: bool
    size_bytes: int
    """0 of a folder."""


class FtpList:
    """Ends in Done(tuple[FtpEntry, ...])."""

    def __init__(self, path: str, *, target: tuple[int, int], numbers: Numbers) -> None:
        self._path, self._encoded = path, as_path(path)
        self._questions = Questions(target, numbers)
        self._found: list[FtpEntry] = []
        self._seen = 0
        """Entries, also those that the vehicle passes over."""
        self._started_s = self._heard_s = 0.0
        self._over = False

    def start(self, now_s: float) -> list[Action]:
        self._started_s = self._heard_s = now_s
        return self._ask(now_s)

    def _ask(self, now_s: float) -> list[Action]:
        return self._questions.ask(now_s, Opcode.LIST_DIRECTORY, offset=self._seen, data=self._encoded)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        heard = None if self._over else self._questions.hear(message)
        if heard is None or not self._questions.is_answer(heard, now_s):
            return []
        self._heard_s = now_s
        if heard.is_refusal(Nak.END_OF_FILE):
            return self._end(Done(tuple(self._found)))
        if heard.opcode == Opcode.NAK:
            what = f"The vehicle does not list {self._path}: {heard.refusal}."
            return self._fail(RefusedError(what, advice="Ask for another folder."))
        return self._take(heard, now_s)

    def _take(self, heard: FtpPayload, now_s: float) -> list[Action]:
        names = [name for name in heard.data.split(b"\0") if name]
        if not names:
            return self._end(Done(tuple(self._found)))
        self._seen += len(names)
        try:
            entries = [_entry(name) for name in names]
        except ValueError:
            return self._fail(self._senseless("names files in a way that makes no sense"))
        self._found += [entry for entry in entries if entry is not None and entry.name not in _OWN_AND_ABOVE]
        if self._seen > MOST_ENTRIES:
            return self._fail(self._senseless(f"lists more than {MOST_ENTRIES} files"))
        return self._ask(now_s)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        return [] if self._over or not state.armed else self._fail(armed_meanwhile())

    def on_tick(self, now_s: float) -> list[Action]:
        if self._over:
            return []
        if now_s - self._heard_s > SILENT_S or now_s - self._started_s > LONGEST_S:
            what = f"The vehicle does not say which files are in {self._path}."
            return self._fail(SilentError(what, advice="Check the link. It may have no files, or no card."))
        return self._questions.on_tick(now_s)

    def cancel(self) -> list[Action]:
        return [] if self._over else self._fail(TransferError("Listing files was cancelled.", advice=""))

    def _senseless(self, does: str) -> TransferError:
        return TransferError(f"The vehicle {does} in {self._path}.", advice="Look at its card with a computer.")

    def _fail(self, error: TelemetryError) -> list[Action]:
        return self._end(Failed(error))

    def _end(self, end: Done | Failed) -> list[Action]:
        self._over = True
        return [end]


def _entry(name: bytes) -> FtpEntry | None:
    """None: an entry that is passed over. Raises ValueError."""
    kind, text = name[:1], name[1:].decode()
    if kind == b"S":
        return None
    text, _, size = text.partition("\t")
    if kind not in (b"F", b"D") or not text or "/" in text or "\\" in text or not text.isprintable():
        raise ValueError(name)
    return FtpEntry(text, kind == b"D", int(size) if kind == b"F" else 0)
