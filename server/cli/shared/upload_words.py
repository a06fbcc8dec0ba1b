"""What came of an upload, for people and for scripts."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from telemetry.topics.onboard_lists import UploadReport


def report_summary(report: UploadReport) -> dict[str, Any]:
    return {
        "verified": report.verified,
        "items": len(report.onboard.items),
        "rounded": [asdict(rounded) for rounded in report.rounded],
        "differences": list(report.differences),
        "digest": report.onboard.digest,
        "seconds": report.seconds,
    }


def report_lines(report: UploadReport) -> list[str]:
    items = f"{len(report.onboard.items)} items in {report.seconds:.1f} s"
    if not report.verified:
        return [f"NOT VERIFIED: {items}, and the vehicle holds something else", *(f"  {d}" for d in report.differences)]
    rounded = [
        f"  item {r.item}: {r.field} {_value(r.field, r.sent)} is kept as {_value(r.field, r.kept)}"
        for r in report.rounded
    ]
    return [f"VERIFIED: {items}, read back", *rounded]


def _value(field: str, value: float | None) -> str:
    """Vehicles keep single precision: more digits than it has are noise, but for places, which are whole numbers."""
    digits = 10 if field in ("latitude", "longitude") else 7
    return "not given" if value is None else f"{value:.{digits}g}"
