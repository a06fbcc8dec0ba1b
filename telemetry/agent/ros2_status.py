"""What an agent tells of the topics that it reads."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from telemetry.ros2.listener import Ros2Listener


@dataclass(slots=True)
class Ros2Status:
    """Written by the thread that reads; may be read from any."""

    listener: Ros2Listener
    frames: int = 0
    poses: int = 0
    unplaced: Counter[str] = field(default_factory=Counter)
    """Frames left out because no transform led to the robot's frame, by what was missing."""
    left_out: Counter[str] = field(default_factory=Counter)
    """Frames, poses and transforms that contradict themselves, by reason."""
    without_place: int = 0
    """Points that were no numbers."""
    without_speed: int = 0
    """Targets without a speed or strength."""
    odd_stamps: int = 0
    """Of another clock than their publisher's: they count as measured when they were published."""
    too_many: int = 0
    """Targets beyond the most of a radar frame: the weakest."""
    clock_offset_s: float = 0.0
    """Of the points' publisher: ours minus its own."""
    held: list[str] = field(default_factory=list)
    """What is wrong now."""

    def as_dict(self) -> dict[str, Any]:
        heard = self.listener
        return {
            "frames": self.frames,
            "poses": self.poses,
            "dropped": dict(heard.inbox.dropped),
            "lost": dict(heard.lost),
            "refused": {f"{topic}: {why}": count for (topic, why), count in dict(heard.refused).items()},
            "unplaced": dict(self.unplaced),
            "left_out": dict(self.left_out),
            "without_place": self.without_place,
            "without_speed": self.without_speed,
            "odd_stamps": self.odd_stamps,
            "too_many": self.too_many,
            "clock_offset_s": round(self.clock_offset_s, 4),
            "interruptions": heard.interruptions,
            "trouble": list(self.held),
        }

    def __str__(self) -> str:
        heard = self.listener
        counts: dict[str, int] = {
            "refused": sum(dict(heard.refused).values()),
            "not taken in time": sum(heard.inbox.dropped.values()),
            "lost": sum(heard.lost.values()),
            "without a transform": sum(dict(self.unplaced).values()),
            "contradicting themselves": sum(dict(self.left_out).values()),
        }
        bad = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        text = f"ROS 2: {self.frames} frames, {self.poses} poses" + (f"; {bad}" if bad else "")
        return f"{text}; {' '.join(self.held)}" if self.held else text
