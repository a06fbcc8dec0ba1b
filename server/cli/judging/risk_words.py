"""What an estimate of risk says, in lines for the terminal, and what it must never be taken for."""

from __future__ import annotations

import math

from planning.certificate.certificate_model import Certificate
from planning.risk.tally import PLACE_M, Risk, Share
from planning.risk.uncertain import Uncertain

STATEMENT = (
    "An estimate under assumed errors, not a proof: it loosens no certificate and stands for none. Left out are "
    "take-off and landing, ways home, downwash, and whatever the surface model does not hold, such as wires."
)


def risk_lines(risk: Risk, uncertain: Uncertain, certificate: Certificate) -> list[str]:
    """Bounds are rounded so that nothing looks safer than it is."""
    verdict = "CERTIFIED" if certificate.certified else "NOT CERTIFIED"
    worst = risk.worst
    contacts = f", {worst.contacts:,} contacts within {PLACE_M:g} m of the line" if worst.contacts else ""
    return [
        STATEMENT,
        f"  certificate: {verdict}, at least {_down(certificate.min_distance_m)} from the surface model, "
        f"{_up(certificate.required_clearance_m)} required",
        f"  contact: {_contact(risk.contact)}",
        f"  hull to surface model: half of the flights come within {_down(risk.hull_m[50.0])}, 1 of 20 within "
        f"{_down(risk.hull_m[5.0])}, 1 of 100 within {_down(risk.hull_m[1.0])}; the nearest of all "
        f"{_down(risk.nearest_hull_m)}",
        f"  worst place: {worst.s_m:.0f} m along the line, at {worst.lat_deg:.7f}, {worst.lon_deg:.7f}, as planned "
        f"{_down(worst.planned_m)} from the surface model{contacts}",
        *_error_lines(uncertain),
    ]


def _contact(share: Share) -> str:
    sure = f"with {100 * share.confidence:g} % confidence"
    if share.hits == 0:
        return (
            f"none on {share.flights:,} flights; {sure} at most {_percent(share.high)} of flights touch it under these "
            "errors, and more flights would be needed to say less"
        )
    return (
        f"on {share.hits:,} of {share.flights:,} flights, {100 * share.estimate:.3g} %; "
        f"{sure} between {100 * share.low:.3g} and {_percent(share.high)}"
    )


def _error_lines(uncertain: Uncertain) -> list[str]:
    lines = [
        f"  random: {error.name}, {_up(error.bound_m)} at {uncertain.sigmas:g} standard deviations, "
        + (f"alike over {error.correlation_m:g} m" if math.isfinite(error.correlation_m) else "the same all along")
        for error in uncertain.errors
    ]
    if uncertain.home_m is None:
        return [*lines, "  not known, so left out: how high the vehicle stands at home"]
    low_m, high_m = uncertain.home_m
    return [*lines, f"  random: the ground at home, the whole line {-low_m:.2f} m lower to {high_m:.2f} m higher"]


def _percent(share: float) -> str:
    """Two digits, rounded up."""
    if share <= 0.0:
        return "0 %"
    step = 10.0 ** (math.floor(math.log10(100 * share)) - 1)
    return f"{min(100.0, math.ceil(100 * share / step - 1e-9) * step):.3g} %"


def _down(value_m: float) -> str:
    return f"{math.floor(100 * value_m + 1e-6) / 100:.2f} m"


def _up(value_m: float) -> str:
    return f"{math.ceil(100 * value_m - 1e-6) / 100:.2f} m"
