"""Diagnostics of alerts: the worst that stands counts, all that stand are inside, and silence is no all-clear."""

from __future__ import annotations

from typing import Any, Literal

import pytest

from telemetry.ros2.outgoing import ALERTS_OUT, Outgoing
from telemetry.ros2.standing import ERROR, MOST_TOLD, OK, SILENT_S, STALE, StandingAlerts
from telemetry.topics.messages import ServerAlive, Topic
from telemetry.topics.obstacles import Obstacle, ObstacleAlert


def alert(
    name: str, phase: Literal["begins", "goes_on", "ends"], distance_m: float | None, **other: Any
) -> ObstacleAlert:
    obstacle = None if distance_m is None else _at(distance_m)
    sensor = other.get("sensor", "radar")
    return ObstacleAlert(name, sensor, "obstacle", phase, 1.0, 1e9, 1.0, f"{name} at {distance_m} m", obstacle)


def _at(distance_m: float) -> Obstacle:
    return Obstacle(
        "roi", distance_m, bearing_deg=10.0, off_nose_deg=0.0, height_difference_m=1.0, time_to_contact_s=None,
        enu_m=(0.0, distance_m, 0.0), lat_deg=None, lon_deg=None, alt_amsl_m=None, voxels=1, size_m=(1.0, 1.0, 1.0),
    )  # fmt: skip


def levels(alerts: StandingAlerts, now_s: float) -> dict[str, int]:
    return {name.removeprefix("hedgehop: "): level for level, name, *_ in alerts.statuses(now_s)}


def test_what_ends_does_not_hide_what_still_stands() -> None:
    alerts = StandingAlerts(0.0)
    for each in (alert("far", "begins", 40.0), alert("near", "begins", 8.0), alert("far", "ends", 40.0)):
        alerts.take(each, 1.0)
    assert levels(alerts, 1.0) == {"station": OK, "radar": ERROR}
    _, _, words, _, values = alerts.statuses(1.0)[1]
    assert words == "near at 8.0 m"
    assert values["alert near"] == words
    assert values["distance_m"] == "8.00"
    assert "alert far" not in values
    alerts.take(alert("blind", "begins", None), 2.0)
    assert alerts.statuses(2.0)[1][2] == "2 stand: blind at None m"
    alerts.take(alert("other", "begins", 3.0, sensor="vision"), 2.0)
    for name in ("near", "blind"):
        alerts.take(alert(name, "ends", None), 3.0)
    assert levels(alerts, 3.0) == {"station": OK, "radar": OK, "vision": ERROR}


def test_many_are_counted_and_the_nearest_told() -> None:
    alerts = StandingAlerts(0.0)
    for number in range(100):
        alerts.take(alert(f"a{number}", "begins", 100.0 - number), 1.0)
    values = alerts.statuses(1.0)[1][4]
    assert (values["standing"], values["id"]) == ("100", "a99")
    assert sum(name.startswith("alert ") for name in values) == MOST_TOLD


@pytest.mark.parametrize("phase", ["begins", "ends"])
def test_a_station_that_stopped_is_stale_whatever_it_told_last(phase: Any) -> None:
    alerts = StandingAlerts(0.0)
    alerts.take(alert("a", phase, 8.0), 1.0)
    assert not alerts.turned(SILENT_S - 0.1)
    assert alerts.turned(SILENT_S + 1.0)
    assert not alerts.turned(SILENT_S + 1.1)
    assert levels(alerts, SILENT_S + 1.1) == {"station": STALE, "radar": STALE}
    alerts.alive(20.0)
    assert alerts.turned(20.1)
    assert levels(alerts, 20.1) == {"station": OK, "radar": ERROR if phase == "begins" else OK}
    assert alerts.turned(40.0)
    alerts.take(alert("a", "goes_on", 7.0), 40.0)  # a sensor that still sees is not stale
    assert levels(alerts, 40.1) == {"station": STALE, "radar": ERROR}


def test_silence_is_told_once_and_ended_by_a_sign_of_the_station() -> None:
    outgoing = Outgoing(0.0)
    assert outgoing.turned(now_mono_s=1.0, now_utc_s=1e9) is None
    (told,) = outgoing.of(Topic.ALERT, alert("a", "begins", 8.0), now_mono_s=1.0, now_utc_s=1e9)
    assert told[0] == ALERTS_OUT
    stale = outgoing.turned(now_mono_s=9.0, now_utc_s=1e9)
    assert stale is not None
    assert b"the station is silent since: a at 8.0 m\0" in stale
    assert outgoing.turned(now_mono_s=9.5, now_utc_s=1e9) is None
    assert not list(outgoing.of(Topic.SERVER, ServerAlive(10.0, 1), now_mono_s=10.0, now_utc_s=1e9))
    assert outgoing.turned(now_mono_s=10.1, now_utc_s=1e9) is not None
    assert not outgoing.is_silent
