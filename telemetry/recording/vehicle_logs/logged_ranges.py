"""What the distance sensors of a vehicle measured, as a log of its own tells it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from telemetry.mavlink.ranges import Scan


class Measured(NamedTuple):
    t_s: float
    """On the log's own clock, from the vehicle's start."""
    scan: Scan


@dataclass(slots=True)
class LoggedRanges:
    """Of all sensors of one log."""

    measured: list[Measured] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    """Measurements by sensor."""
    out_of_range: int = 0
    """Measurements of single directions that hit nothing within the sensor's limits."""
    not_valid: Counter[str] = field(default_factory=Counter)
    """By why they were left out."""
    notes: list[str] = field(default_factory=list)

    def take(self, sensor: str, t_s: float, scan: Scan | None) -> None:
        """None: it is not valid, or cannot be understood."""
        if scan is None:
            self.not_valid[f"{sensor}: not valid, or not understood"] += 1
            return
        self.counts[sensor] += 1
        self.out_of_range += not scan.beams
        self.measured.append(Measured(t_s, scan))

    def sentences(self) -> list[str]:
        """What was read, what was left out, and what is doubtful."""
        told = [f"{sensor}: {count:,}" for sensor, count in sorted(self.counts.items())]
        said = [f"Measurements in the log: {', '.join(told)}; {self.out_of_range:,} hit nothing."] if told else []
        left_out = [f"{count:,} ({why})" for why, count in self.not_valid.most_common()]
        if left_out:
            said.append(f"Measurements that are not believed: {', '.join(left_out)}.")
        return said + self.notes


def in_time(measured: Iterable[Measured]) -> list[list[Measured]]:
    """The earliest first; those of one moment together."""
    moments: list[list[Measured]] = []
    for each in sorted(measured, key=lambda m: m.t_s):
        if moments and moments[-1][0].t_s == each.t_s:
            moments[-1].append(each)
        else:
            moments.append([each])
    return moments
