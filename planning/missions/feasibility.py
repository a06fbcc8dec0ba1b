"""Whether a vehicle can fly a mission at all: the second verdict beside the clearance, row by row.

A line may keep all its distance and still be longer than the battery lasts. Whoever knows more of a plan, such as what
its photos cover, adds rows with ``Feasibility.with_rows``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Mission, VehicleProfile

RowState = Literal["holds", "fails", "unknown"]

_AIR_SPEED, _GROUND_SPEED, _CLIMB_SPEED, _DESCENT_SPEED = 0, 1, 2, 3
"""MAV_CMD_DO_CHANGE_SPEED, parameter 1."""
_SLACK_M_S = 1e-6


@dataclass(frozen=True, slots=True)
class FeasibilityRow:
    """One thing that the vehicle must be able to do."""

    code: str
    state: RowState
    text: str
    mend: str = ""


@dataclass(frozen=True, slots=True)
class Feasibility:
    rows: tuple[FeasibilityRow, ...]

    @property
    def feasible(self) -> bool | None:
        """None: nothing fails, but not all is known."""
        states = {row.state for row in self.rows}
        return False if "fails" in states else None if "unknown" in states else True

    @property
    def failures(self) -> tuple[FeasibilityRow, ...]:
        return tuple(row for row in self.rows if row.state == "fails")

    def with_rows(self, *rows: FeasibilityRow) -> Feasibility:
        return Feasibility((*self.rows, *rows))


def feasibility_of(mission: Mission, profile: VehicleProfile, predicted_s: float | None) -> Feasibility:
    """``predicted_s`` from take-off to touchdown; None: nothing predicts it."""
    return Feasibility(
        (
            battery_row(predicted_s, profile),
            _speed_row(mission, profile),
            _climb_row(mission, profile),
            _items_row(mission, profile),
        )
    )


def not_judged(why: str) -> Feasibility:
    """Of a mission whose vehicle nobody has named."""
    return Feasibility((FeasibilityRow("vehicle", "unknown", why, "Name the vehicle."),))


def battery_row(predicted_s: float | None, profile: VehicleProfile) -> FeasibilityRow:
    """The predicted flight against the endurance less its reserve."""
    usable_s = profile.usable_endurance_s
    usable = f"endurance less reserve is {_time(usable_s)}"
    if predicted_s is None:
        return FeasibilityRow("battery", "unknown", f"How long the flight takes is not known; {usable}.")
    text = f"The flight takes {_time(predicted_s)}; {usable}."
    if predicted_s <= usable_s:
        return FeasibilityRow("battery", "holds", text)
    return FeasibilityRow("battery", "fails", text, "Fly faster, shorten the route or split it.")


def photos_row(faults: Sequence[str]) -> FeasibilityRow:
    """Whether a survey's photos show what was asked; ``faults`` say what they do not."""
    if not faults:
        return FeasibilityRow("photos", "holds", "The photos show the area as asked.")
    return FeasibilityRow("photos", "fails", " ".join(faults), "Ask for more overlap, or fly more lines.")


def _speed_row(mission: Mission, profile: VehicleProfile) -> FeasibilityRow:
    fastest_m_s = commanded_speed_m_s(mission)
    limit = f"the vehicle's limit is {profile.max_speed_m_s:g} m/s"
    if fastest_m_s is None:
        return FeasibilityRow("speed", "holds", f"The mission sets no speed; {limit}.")
    text = f"The mission flies at up to {fastest_m_s:g} m/s; {limit}."
    if fastest_m_s <= profile.max_speed_m_s + _SLACK_M_S:
        return FeasibilityRow("speed", "holds", text)
    return FeasibilityRow("speed", "fails", text, "Set a lower speed, or the vehicle's true limit.")


def _climb_row(mission: Mission, profile: VehicleProfile) -> FeasibilityRow:
    limit = f"the vehicle's limits are {profile.max_climb_m_s:g} up and {profile.max_descent_m_s:g} m/s down"
    up_m_s = _largest(mission, lambda kind: kind == _CLIMB_SPEED)
    down_m_s = _largest(mission, lambda kind: kind == _DESCENT_SPEED)
    if up_m_s is None and down_m_s is None:
        text = f"The mission sets no climb or descent; steeper legs are flown slower, and {limit}."
        return FeasibilityRow("climb", "holds", text)
    up_m_s, down_m_s = up_m_s or 0.0, down_m_s or 0.0
    text = f"The mission sets {up_m_s:g} m/s up and {down_m_s:g} m/s down; {limit}."
    if up_m_s <= profile.max_climb_m_s + _SLACK_M_S and down_m_s <= profile.max_descent_m_s + _SLACK_M_S:
        return FeasibilityRow("climb", "holds", text)
    return FeasibilityRow("climb", "fails", text, "Set lower ones, or the vehicle's true limits.")


def _items_row(mission: Mission, profile: VehicleProfile) -> FeasibilityRow:
    text = f"The mission has {len(mission.items)} items; the vehicle takes {profile.max_items}."
    if len(mission.items) <= profile.max_items:
        return FeasibilityRow("items", "holds", text)
    return FeasibilityRow("items", "fails", text, "Allow more excess height, or split the mission.")


def commanded_speed_m_s(mission: Mission) -> float | None:
    """The fastest that the mission's own items ask for; None when they ask for none."""
    return _largest(mission, lambda kind: kind in (_AIR_SPEED, _GROUND_SPEED))


def _largest(mission: Mission, wanted: Callable[[int], bool]) -> float | None:
    """Items with a speed of -1 or 0 leave it as it is."""
    commands = [item.params for item in mission.items if item.command == MavCmd.DO_CHANGE_SPEED]
    speeds = [params[1] for params in commands if wanted(round(params[0])) and params[1] > 0]
    return max(speeds, default=None)


def feasibility_json(feasibility: Feasibility) -> dict[str, Any]:
    rows = [{"code": r.code, "state": r.state, "text": r.text, "mend": r.mend} for r in feasibility.rows]
    return {"feasible": feasibility.feasible, "feasibility": rows}


def verdict_words(*, certified: bool, feasible: bool | None) -> str:
    """Both verdicts at a glance."""
    clearance = "CERTIFIED" if certified else "NOT CERTIFIED"
    words = {True: "FEASIBLE", False: "NOT FEASIBLE", None: "feasibility not judged"}
    return f"{clearance}, {words[feasible]}"


def _time(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"
