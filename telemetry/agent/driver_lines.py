"""Lines of JSON that a sensor's driver writes: one that is no reading is counted and told, and the next one passes."""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from telemetry.agent.client import CloudReading, NoticeReading, RadarReading, Reading
from telemetry.agent.link_messages import BINS_MAX, TARGET_COLUMNS, Slam, Uwb, intensity_of
from telemetry.errors import SensorLinkError

HOPELESS = 20
"""So many lines, all bad, from the first one on: it is no driver that writes them."""
NOTICE_EVERY_S = 10.0
LONGEST_LINE_BYTES = 1 << 25
"""Five times a cloud of 100,000 points; a longer one is read in pieces, which are bad."""
_TRACKING = ("good", "poor", "lost")
_ADVICE = 'Write {"type": "radar", "targets": [[x, y, z, speed, snr], ...]} or as docs/agent.md says.'


class BadLineError(SensorLinkError):
    """A line that is no reading; ``kind`` is the same for all that are wrong in the same way."""

    def __init__(self, kind: str, detail: str) -> None:
        super().__init__(f"{kind}: {detail}", advice=_ADVICE)
        self.kind = kind


@dataclass(slots=True)
class LineCounts:
    """What an agent tells of its driver."""

    good: int = 0
    bad: Counter[str] = field(default_factory=Counter)
    """By what was wrong."""
    last: str = ""
    """The last bad one: its number and what was wrong with it."""

    def as_dict(self) -> dict[str, Any]:
        return {"good": self.good, "bad": self.bad.total(), "reasons": dict(self.bad), "last_bad": self.last}

    def __str__(self) -> str:
        text = f"driver: good lines {self.good}, bad ones {self.bad.total()}"
        reasons = ", ".join(f"{count} {kind}" for kind, count in self.bad.most_common())
        return f"{text} ({reasons}); the last: {self.last}" if reasons else text


class DriverLines:
    """``readings`` blocks, in a thread of its own; ``counts`` may be read from any."""

    def __init__(
        self, stream: BinaryIO, *, tell: Callable[[str], None], now: Callable[[], float] = time.monotonic
    ) -> None:
        """``tell`` hears of the first bad line of each kind."""
        self._stream, self._tell, self._now = stream, tell, now
        self._noticed_s = -math.inf
        self.counts = LineCounts()

    def readings(self) -> Iterator[Reading]:
        """Until the stream ends, with a notice for the pilot when lines are bad.

        Raises SensorLinkError where not a single line is good: somebody can still put that right.
        """
        number = 0
        while line := self._stream.readline(LONGEST_LINE_BYTES):
            number += 1
            if not line.strip():
                continue
            try:
                reading = reading_of(line, now_s=self._now())
            except BadLineError as error:
                yield from self._left_out(number, error)
            else:
                self.counts.good += 1
                yield reading
        self._check_hope(ended=True)

    def _left_out(self, number: int, error: BadLineError) -> Iterator[NoticeReading]:
        counts = self.counts
        counts.bad[error.kind] += 1
        counts.last = f"line {number}, {error.what}"
        if counts.bad[error.kind] == 1:
            self._tell(f"Line {number} is left out, {error.what} {error.advice}")
        self._check_hope(ended=False)
        if self._now() - self._noticed_s >= NOTICE_EVERY_S:
            self._noticed_s = self._now()
            total = counts.bad.total()
            lines = "A bad line was" if total == 1 else f"{total} bad lines were"
            yield NoticeReading(self._now(), True, f"driver: {lines} left out. The last: {counts.last}")

    def _check_hope(self, *, ended: bool) -> None:
        bad = self.counts.bad.total()
        if self.counts.good or not bad or (bad < HOPELESS and not ended):
            return
        raise SensorLinkError(
            f"None of the first {bad} lines is a reading of a sensor. The last: {self.counts.last}",
            where="standard input",
            advice=_ADVICE,
        )


def reading_of(line: bytes, *, now_s: float) -> Reading:
    """Without "t_s" it was measured now. Raises BadLineError."""
    record = _record(line)
    try:
        t_s = float(record.get("t_s", now_s))
        if not math.isfinite(t_s):
            raise ValueError(f"t_s is {t_s}")
        return _reading(record, t_s)
    except KeyError as error:
        raise BadLineError("a field is missing", f'there is no "{error.args[0]}".') from error
    except (ValueError, TypeError, OverflowError) as error:
        raise BadLineError("wrong values", f"{error}.") from error


def _record(line: bytes) -> dict[str, Any]:
    try:
        record = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise BadLineError("no JSON", f"{error}.") from error
    if not isinstance(record, dict):
        raise BadLineError("no JSON object", f"it is a {type(record).__name__}.")
    return record


def _reading(record: dict[str, Any], t_s: float) -> Reading:
    match record["type"]:
        case "radar":
            return RadarReading(t_s, _table(record["targets"], TARGET_COLUMNS))
        case "cloud":
            return CloudReading(t_s, _table(record["points"], 3))
        case "slam":
            return _slam(record, t_s)
        case "uwb":
            return _uwb(record, t_s)
        case other:
            raise BadLineError("unknown type", f"{json.dumps(other)[:40]}; there are radar, cloud, slam and uwb.")


def _table(values: Any, columns: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    with np.errstate(over="ignore"):  # it becomes inf, which is left out and counted as such
        table = np.asarray(values, dtype=np.float32)
    if table.size == 0:
        return np.zeros((0, columns), np.float32)
    if table.ndim != 2 or table.shape[1] != columns:
        raise ValueError(f"a row has {columns} numbers")
    return table


def _slam(record: dict[str, Any], t_s: float) -> Slam:
    x, y, z = (float(value) for value in record["position_m"])
    qw, qx, qy, qz = (float(value) for value in record["q_wxyz"])
    tracking = record.get("tracking", "good")
    if tracking not in _TRACKING:
        raise ValueError(f"tracking is one of {', '.join(_TRACKING)}")
    return Slam(t_s, (x, y, z), (qw, qx, qy, qz), tracking)


def _uwb(record: dict[str, Any], t_s: float) -> Uwb:
    intensity = np.asarray(record["intensity"], dtype=np.float32)
    if intensity.ndim != 1 or len(intensity) > BINS_MAX:
        raise ValueError(f"a scan is one row of at most {BINS_MAX} numbers")
    names = ("bin_m", "first_bin_m", "beamwidth_deg", "bearing_deg")
    told = {name: float(record[name]) for name in names if name in record}
    scan = Uwb(0, t_s, intensity.astype("<f4").tobytes(), **told)
    try:
        intensity_of(scan)
    except SensorLinkError as error:
        raise ValueError(error.what) from error
    return scan
