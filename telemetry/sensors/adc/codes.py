"""How 16-bit samples stand for numbers: two's complement or offset binary, told by how they fill their scale.

Words lie on a ring of 65536. What an unclipped signal never reaches are the ends of its scale: for two's complement
they lie between 32767 and -32768, for offset binary, whose zero is in the middle, between 0 and 65535. A capture card
that stores offset binary thus gives itself away, and so does what is no unclipped signal in either code.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.errors import RadarDataError
from mapping.geometry.arrays import F32, I64, U16

SampleCode = Literal["auto", "twos-complement", "offset-binary"]

TOUCHING = 1e-4
"""Share of samples within 1/256 of the scale's ends beyond which a code does not fit."""
TOUCHING_TOLD = 1e-2
"""The same where the operator says which code it is: here and there a receiver may have been driven too far."""
STEADY = 10.0
"""A mean of so many standard deviations is no signal's, for receivers do not pass direct current."""
LEAST_OFFSET = 512
_SCALE = 1 << 16
_END = _SCALE // 256
_BITS = (12, 14, 16)


@dataclass(frozen=True, slots=True)
class Code:
    """What is to be taken off each word."""

    zero: int | None
    """The word that stands for 0 in offset binary; None: two's complement."""
    note: str = ""
    """What was found or put right; empty: as usual."""

    def numbers(self, words: U16) -> F32:
        if self.zero is None:
            return words.view(np.int16).astype(np.float32)
        return words.astype(np.float32) - self.zero


def histogram(words: U16) -> I64:
    """(65536,) how often each word occurs."""
    return np.bincount(words, minlength=_SCALE)


def told(counts: I64, asked: SampleCode, name: str) -> Code:
    """The code of words that occur so often, looked for or as asked. Raises RadarDataError where none fits."""
    if asked == "twos-complement":
        return _as_asked(Code(None), counts, asked, name)
    if asked == "offset-binary":
        return _as_asked(_offset(counts) or Code(_SCALE // 2), counts, asked, name)
    fits = [_at_ends(counts, seam) <= TOUCHING for seam in (_SCALE // 2, 0)]
    if not any(fits):
        signed, offset = (_at_ends(counts, seam) for seam in (_SCALE // 2, 0))
        raise RadarDataError(
            f"Its samples fill their 16 bits to the ends, read as two's complement ({signed:.2%} of them within 1/256 "
            f"of an end) and as offset binary ({offset:.2%}): that is no unclipped signal.",
            where=name,
            advice="If the receiver was driven too far here and there, say how they are stored: --samples "
            "twos-complement or offset-binary. Otherwise this is another format, or another order of bytes.",
        )
    offset = _offset(counts)
    if offset is not None:
        return offset
    if fits[0] and not _is_steady(counts, _SCALE // 2):
        return Code(None)
    if fits[1] and not _is_steady(counts, 0):
        return _offset_code(16)
    raise _steady(counts, name)


def _as_asked(code: Code, counts: I64, asked: SampleCode, name: str) -> Code:
    at_ends = _at_ends(counts, _SCALE // 2 if code.zero is None else 0)
    if at_ends > TOUCHING_TOLD:
        raise RadarDataError(
            f"As {asked.replace('-', ' ')}, {at_ends:.1%} of its samples stand at the ends of their scale: that is no "
            "unclipped signal.",
            where=name,
            advice="Leave --samples out to have it looked for, or record again with less gain.",
        )
    if at_ends > TOUCHING:
        return Code(code.zero, f"{at_ends:.2%} of its samples stand at the ends of their scale: they were clipped.")
    return Code(code.zero)


def _offset(counts: I64) -> Code | None:
    """Offset binary of 12, 14 or 16 bits: words that stand around the middle of so many bits, and never leave them."""
    mean, spread, highest = _mean_and_spread(counts, 0)
    for bits in _BITS:
        middle = 1 << (bits - 1)
        beside = abs(mean - middle)
        if highest < 2 * middle and beside < 0.05 * middle and spread < 0.3 * middle and mean > STEADY * spread / 4:
            return _offset_code(bits)
    return None


def _offset_code(bits: int) -> Code:
    zero = 1 << (bits - 1)
    return Code(zero, f"Its samples are stored in offset binary of {bits} bits: {zero} was taken off each.")


def _is_steady(counts: I64, seam: int) -> bool:
    mean, spread, _ = _mean_and_spread(counts, seam)
    zero = 0.0 if seam else _SCALE / 2
    return abs(mean - zero) > max(LEAST_OFFSET, STEADY * spread)


def _steady(counts: I64, name: str) -> RadarDataError:
    mean, spread, _ = _mean_and_spread(counts, _SCALE // 2)
    return RadarDataError(
        f"All of its samples lie around {mean:,.0f}, {spread:,.0f} to either side: no receiver passes such a steady "
        "offset.",
        where=name,
        advice="If that is its zero, take it off and save the samples again; --samples twos-complement takes them as "
        "they are.",
    )


def _at_ends(counts: I64, seam: int) -> float:
    """Share of words within 1/256 of the place on the ring where a scale's ends meet."""
    near = np.arange(seam - _END, seam + _END) % _SCALE
    return float(counts[near].sum() / max(counts.sum(), 1))


def _mean_and_spread(counts: I64, seam: int) -> tuple[float, float, int]:
    """Mean, standard deviation and highest of the numbers, with the scale's ends at ``seam``."""
    numbers = np.arange(_SCALE, dtype=np.int64)
    if seam:
        numbers = np.where(numbers >= seam, numbers - _SCALE, numbers)
    total = max(int(counts.sum()), 1)
    mean = float(counts @ numbers) / total
    spread = float(np.sqrt(max(counts @ (numbers.astype(np.float64) - mean) ** 2 / total, 0.0)))
    return mean, spread, int(numbers[counts > 0].max(initial=0))
