"""A long survey in parts: neighbouring lines each, with the part of the area that these lines are for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.errors import ParameterError
from planning.route.survey import SurveyPlan, strip_borders_m, turn
from planning.terrain.dsm import SurfaceModel

_SMALLEST_CAP_SHARE = 1e-3
"""How exactly parts are made alike, of the longest."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Neighbouring lines of a survey, counted from 0 in flying order, the last left out."""

    first: int
    stop: int

    @property
    def words(self) -> str:
        """As people count."""
        if self.stop == self.first + 1:
            return f"line {self.stop}"
        return f"lines {self.first + 1} to {self.stop}"

    def __len__(self) -> int:
        return self.stop - self.first


def part_of(survey: SurveyPlan, model: SurfaceModel, lines: Lines) -> SurveyPlan:
    """These lines alone, as they are in the survey, and what of its area lies in the strips that they cover.

    The areas of all parts together are the survey's: strips meet where the lines' halves do.
    """
    if lines == Lines(0, survey.lines):
        return survey
    pairs = [k for k, row in enumerate(survey.row_of) if lines.first <= row < lines.stop]
    return replace(
        survey,
        pois=tuple(poi for k in pairs for poi in survey.pois[2 * k : 2 * k + 2]),
        row_of=tuple(survey.row_of[k] - lines.first for k in pairs),
        lines=len(lines),
        polygon_lat_lon_deg=_area(survey, model, lines),
    )


class LineCosts:
    """About how long a flight over neighbouring lines takes, from home and back: enough to share them out.

    Metres over ground at the mean speed, and what every flight takes beside. What a flight really takes its plan says.
    """

    def __init__(
        self,
        survey: SurveyPlan,
        model: SurfaceModel,
        *,
        home_lat_lon_deg: tuple[float, float] | None,
        mean_speed_m_s: float,
        each_s: float,
    ) -> None:
        """``home_lat_lon_deg``: None: each flight begins at its own first point. ``each_s``: take-off and landing."""
        ends_m = model.xy_from_lat_lon(np.array([(poi.lat_deg, poi.lon_deg) for poi in survey.pois]))
        rows = np.repeat(np.array(survey.row_of), 2)
        firsts = np.searchsorted(rows, np.arange(survey.lines))
        lasts = np.searchsorted(rows, np.arange(survey.lines), side="right") - 1
        self._begin_m, self._end_m = ends_m[firsts], ends_m[lasts]
        flown_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ends_m, axis=0).T))])
        self._begins_at_m, self._ends_at_m = flown_m[firsts], flown_m[lasts]
        self._home_m = None if home_lat_lon_deg is None else model.xy_from_lat_lon(np.array([home_lat_lon_deg]))[0]
        self._mean_speed_m_s, self._each_s = mean_speed_m_s, each_s

    def __len__(self) -> int:
        return len(self._begin_m)

    def seconds(self, lines: Lines) -> float:
        begin_m, end_m = self._begin_m[lines.first], self._end_m[lines.stop - 1]
        home_m = begin_m if self._home_m is None else self._home_m
        ways_m = math.dist(home_m, begin_m) + math.dist(end_m, home_m)
        along_m = self._ends_at_m[lines.stop - 1] - self._begins_at_m[lines.first]
        return self._each_s + (ways_m + along_m) / self._mean_speed_m_s


def parts_within(costs: LineCosts, most_s: float) -> list[Lines]:
    """As few parts as take no longer each, as alike as may be; a line that takes longer is a part of its own."""
    filled = _filled(costs, most_s)
    alike = _alike(costs, len(filled))
    # Beside a line that takes longer by itself, parts that are alike may take as long as that one.
    return alike if all(len(part) == 1 or costs.seconds(part) <= most_s for part in alike) else filled


def parts_in_number(costs: LineCosts, count: int) -> list[Lines]:
    """So many parts, as alike as may be. Raises ParameterError where there are fewer lines."""
    if not 1 <= count <= len(costs):
        lines = f"{len(costs)} lines" if len(costs) > 1 else "one line"
        raise ParameterError(
            f"A survey of {lines} has no {count} parts.",
            where="--parts",
            advice=f"Give a number from 1 to {len(costs)}.",
        )
    parts = _alike(costs, count)
    while len(parts) < count:
        longest = max((part for part in parts if len(part) > 1), key=costs.seconds)
        middle = (longest.first + longest.stop) // 2
        parts.append(Lines(longest.first, middle))
        parts[parts.index(longest)] = Lines(middle, longest.stop)
    return sorted(parts, key=lambda part: part.first)


def _filled(costs: LineCosts, most_s: float) -> list[Lines]:
    """Each part as long as may be, from the first line on."""
    parts = [Lines(0, 1)]
    for line in range(1, len(costs)):
        longer = Lines(parts[-1].first, line + 1)
        if costs.seconds(longer) <= most_s:
            parts[-1] = longer
        else:
            parts.append(Lines(line, line + 1))
    return parts


def _alike(costs: LineCosts, most: int) -> list[Lines]:
    """At most so many parts, the longest as short as may be."""
    longest_s = max(costs.seconds(Lines(line, line + 1)) for line in range(len(costs)))
    low_s = high_s = longest_s  # no part is shorter than its lines
    while len(_filled(costs, high_s)) > most:
        low_s, high_s = high_s, 2.0 * high_s
    while high_s - low_s > _SMALLEST_CAP_SHARE * high_s:
        middle_s = (low_s + high_s) / 2
        low_s, high_s = (low_s, middle_s) if len(_filled(costs, middle_s)) <= most else (middle_s, high_s)
    return _filled(costs, high_s)


def _area(survey: SurveyPlan, model: SurfaceModel, lines: Lines) -> tuple[tuple[float, float], ...]:
    corners_m = model.xy_from_lat_lon(np.array(survey.polygon_lat_lon_deg))
    turned_m = corners_m @ turn(survey.angle_deg).T
    borders_m = strip_borders_m(turned_m, survey.lines)
    if lines.first > 0:
        turned_m = _above(turned_m, float(borders_m[lines.first]))
    if lines.stop < survey.lines:
        turned_m = _above(turned_m * (1.0, -1.0), -float(borders_m[lines.stop])) * (1.0, -1.0)
    places = model.lat_lon_from_xy(turned_m @ turn(survey.angle_deg))
    return tuple((float(lat_deg), float(lon_deg)) for lat_deg, lon_deg in places)


def _above(corners_m: F64, low_m: float) -> F64:
    """What of a polygon (N, 2) has y >= ``low_m``; several pieces are joined by edges of no width along the cut.

    Sutherland and Hodgman 1974.
    """
    kept: list[Sequence[float]] = []
    before = corners_m[-1]
    for corner in corners_m:
        if (before[1] >= low_m) != (corner[1] >= low_m):
            share = (low_m - before[1]) / (corner[1] - before[1])
            kept.append((before[0] + share * (corner[0] - before[0]), low_m))
        if corner[1] >= low_m:
            kept.append(corner)
        before = corner
    return np.array(kept, dtype=np.float64).reshape(-1, 2)
