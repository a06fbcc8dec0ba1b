"""The simulated vehicle's battery: what flying costs and how its voltage sags."""

from __future__ import annotations

from dataclasses import dataclass

CELLS = 3
FULL_CELL_V = 4.2
KNEE_CELL_V = 3.6
EMPTY_CELL_V = 3.2
KNEE_SHARE = 0.15
"""Below this share the voltage falls steeply."""


@dataclass(frozen=True, slots=True)
class Pack:
    capacity_mah: float = 9000.0
    hover_a: float = 27.0
    """ArduCopter's simulated quadcopter draws this much."""
    idle_a: float = 0.5
    resistance_ohm: float = 0.012


class Battery:
    """Charge is counted; 9 Ah last 20 minutes of hovering."""

    def __init__(self, pack: Pack) -> None:
        self.pack = pack
        self.used_mah = 0.0
        self.current_a = 0.0

    def step(self, thrust_share: float | None, dt_s: float) -> None:
        """``thrust_share``: thrust over weight, None with the motors off."""
        self.current_a = self.pack.idle_a
        if thrust_share is not None:
            # Induced power goes with thrust^1.5 (momentum theory).
            self.current_a += self.pack.hover_a * max(thrust_share, 0.1) ** 1.5
        self.used_mah += self.current_a * dt_s / 3.6

    @property
    def share(self) -> float:
        return max(0.0, 1 - self.used_mah / self.pack.capacity_mah)

    @property
    def empty(self) -> bool:
        return self.used_mah >= self.pack.capacity_mah

    @property
    def voltage_v(self) -> float:
        share = self.share
        if share > KNEE_SHARE:
            cell = KNEE_CELL_V + (FULL_CELL_V - KNEE_CELL_V) * (share - KNEE_SHARE) / (1 - KNEE_SHARE)
        else:
            cell = EMPTY_CELL_V + (KNEE_CELL_V - EMPTY_CELL_V) * share / KNEE_SHARE
        return CELLS * cell - self.current_a * self.pack.resistance_ohm
