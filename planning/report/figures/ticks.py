"""Round axis ticks: 1, 2 or 5 times a power of ten."""

from __future__ import annotations

import math


def round_step(span: float, count: int) -> float:
    """The smallest 1-2-5 step that divides ``span`` into at most ``count`` parts."""
    raw = max(span, 1e-12) / max(count, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * (1 - 1e-9))


def ticks(low: float, high: float, count: int = 6) -> list[float]:
    """Round values inside [low, high], about ``count`` of them."""
    step = round_step(high - low, count)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def label(value: float, step: float) -> str:
    """A tick's text with as many decimals as its step needs."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value + 0.0:.{decimals}f}"


def padded(low: float, high: float, count: int = 6) -> tuple[float, float]:
    """The range widened to whole ticks."""
    step = round_step(max(high - low, 1e-9), count)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return first * step, max(last, first + 1) * step
