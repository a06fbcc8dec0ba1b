"""A survey in parts, planned side by side: each a flight of its own, with its own files and its own certificate."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from planning.basics.plan_model import VehicleProfile
from planning.errors import CapacityError, DescribedError, NothingLeftError
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest, survey_request
from planning.report.exports import FILES, export_file
from planning.report.summary import plan_summary, survey_summary
from planning.report.words import duration, metres
from planning.route.survey_coverage import SurveyCoverage
from planning.route.survey_parts import LineCosts, Lines, part_of, parts_in_number, parts_within
from planning.terrain.dsm import SurfaceModel
from planning.terrain.rasters.http_ranges import is_address
from server.cli.shared.files_in_out import check_directory, write_files
from server.cli.shared.options import ModelOptions
from server.cli.shared.output import answer, end_progress, harmless, progress, say_notes
from server.cli.shared.terrain_given import OpenedModel, open_model, same_model
from server.cli.shared.verdict import photos_words, verdict_lines
from server.errors import StorageError
from server.library.shelf import utc_now
from server.work.clocks import StepTimer
from server.work.cluster import spread

AUTO = 0
SUMMARY = "parts.json"
_SHORTER = 0.98
"""Parts that did not do are made so much shorter than what would just do."""
_CAPACITY_SHARE = 0.7
"""Of a part with more items than the vehicle takes; how many it would have had nobody knows."""
_STEP = "Planning the parts"


@dataclass(frozen=True, slots=True)
class PartsOrder:
    """What is to be planned in parts, and where its files go."""

    dsm: Path
    out: Path
    model: ModelOptions
    title: str
    number: int
    """``AUTO``: as few as battery and items allow."""
    cluster: str | None


@dataclass(frozen=True, slots=True)
class _Piece:
    """What a worker is told of one part."""

    dsm: Path
    model: ModelOptions
    sha256: str
    request: PlanRequest
    lines: Lines
    title: str
    created_utc: str


@dataclass(frozen=True, slots=True)
class _Planned:
    """What comes back."""

    lines: Lines
    files: dict[str, bytes]
    """UTF-8, packed by zlib."""
    summary: dict[str, Any]
    coverage: SurveyCoverage | None
    notes: tuple[str, ...]
    error: DescribedError | None = None

    def takes(self, profile: VehicleProfile) -> float:
        """Seconds; for want of a plan more than the battery gives."""
        if self.error is not None:
            return profile.usable_endurance_s / _CAPACITY_SHARE
        return self.summary["duration_s"]


def plan_parts(order: PartsOrder, request_for: Callable[[SurfaceModel], PlanRequest], *, as_json: bool) -> bool:
    """Plans all parts, writes their files, says what came of them; whether all are certified and feasible.

    ``request_for`` gives the request of the whole survey. Nothing is written before all parts are planned.
    """
    check_directory(order.out)
    _refuse_others(order.out)
    opened = open_model(order.dsm, StepTimer(progress), order.model)
    request = request_for(opened.model)
    created_utc = utc_now()
    path = order.dsm if is_address(order.dsm) else order.dsm.absolute()

    def planned(parts: list[Lines]) -> list[_Planned]:
        pieces = [
            _Piece(
                path, order.model, opened.model.sha256, _request_of(request, opened.model, lines), lines,
                f"{order.title}, {lines.words}", created_utc,
            )
            for lines in parts
        ]  # fmt: skip
        done = list(spread(_part, pieces, order.cluster, lambda share: progress(_STEP, share)))
        end_progress()
        return done

    found = _all_parts(order, request, opened.model, planned)
    flown = [part for part in found if part.error is None]
    for part in found:
        if isinstance(part.error, NothingLeftError):
            say_notes(f"{part.lines.words}: the fence leaves nothing of them.")
    if not flown:
        raise NothingLeftError("The fence leaves nothing of the survey.", advice="Draw the area inside the fence.")
    return _written(order, flown, as_json=as_json)


def _all_parts(
    order: PartsOrder,
    request: PlanRequest,
    model: SurfaceModel,
    planned: Callable[[list[Lines]], list[_Planned]],
) -> list[_Planned]:
    """In as many rounds as it takes until each part fits into battery and items, or is a single line."""
    assert request.survey is not None
    profile = request.profile
    costs = LineCosts(
        request.survey,
        model,
        home_lat_lon_deg=request.home_lat_lon_deg,
        mean_speed_m_s=request.path.mean_speed_m_s,
        each_s=request.surface.height_m * (1 / profile.max_climb_m_s + 1 / profile.max_descent_m_s),
    )
    if order.number != AUTO:
        found = planned(parts_in_number(costs, order.number))
        _raise_first(found)
        return found
    most_s = profile.usable_endurance_s
    known: dict[Lines, _Planned] = {}
    while True:
        parts = parts_within(costs, most_s)
        unknown = [lines for lines in parts if lines not in known]
        known |= {part.lines: part for part in planned(unknown)}
        found = [known[lines] for lines in parts]
        _raise_first([part for part in found if not (isinstance(part.error, CapacityError) and len(part.lines) > 1)])
        long = [
            part for part in found
            if not isinstance(part.error, NothingLeftError)
            and len(part.lines) > 1
            and part.takes(profile) > profile.usable_endurance_s
        ]  # fmt: skip
        if not long:
            return found
        share = min(profile.usable_endurance_s / part.takes(profile) for part in long)
        most_s = _SHORTER * min(share, 1.0) * max(costs.seconds(part.lines) for part in long)


def _raise_first(found: list[_Planned]) -> None:
    for part in found:
        if part.error is not None and not isinstance(part.error, NothingLeftError):
            error = part.error
            where = f"{part.lines.words}: {error.where}" if error.where else part.lines.words
            raise type(error)(error.what, where=where, advice=error.advice)


def _request_of(request: PlanRequest, model: SurfaceModel, lines: Lines) -> PlanRequest:
    assert request.survey is not None
    part = part_of(request.survey, model, lines)
    return survey_request(replace(request, survey=None), part)


def _part(piece: _Piece) -> _Planned:
    """On a worker, or here."""
    try:
        opened = same_model(piece.dsm, piece.model, piece.sha256)
        plan = plan_mission(opened.model, piece.request, assumptions=opened.made)
    except DescribedError as error:
        return _Planned(piece.lines, {}, {}, None, (), error)
    texts = {
        name: export_file(name, plan, opened.model, title=piece.title, created_utc=piece.created_utc) for name in FILES
    }
    files = {name: zlib.compress(text.encode()) for name, text in texts.items()}
    return _Planned(piece.lines, files, plan_summary(plan, opened.model), plan.coverage, _notes(opened, plan))


def _notes(opened: OpenedModel, plan: Plan) -> tuple[str, ...]:
    return (*opened.part_notes(plan.ground), *plan.warnings)


def _refuse_others(out: Path) -> None:
    """Parts of another survey beside these would be flown by mistake."""
    if (out / SUMMARY).exists() or any(out.glob("part-*")):
        raise StorageError(
            "There are parts of a survey in it already.", where=str(out), advice="Give another --out, or remove them."
        )


def _written(order: PartsOrder, parts: list[_Planned], *, as_json: bool) -> bool:
    entries, lines = [], []
    for number, part in enumerate(parts, 1):
        folder = f"part-{number:0{len(str(len(parts)))}d}"
        write_files(order.out / folder, {name: zlib.decompress(data).decode() for name, data in part.files.items()})
        say_notes(*(f"{folder}: {note}" for note in part.notes))
        entries.append({"folder": folder, "lines": [part.lines.first + 1, part.lines.stop], **part.summary})
        lines += _part_lines(folder, part)
    together = _together([part.coverage for part in parts])
    faults = () if together is None else together.faults()
    summary = {
        "certified": all(part.summary["certified"] for part in parts),
        "feasible": all(part.summary["feasible"] for part in parts) and not faults,
        "survey": None if together is None else survey_summary(together),
        "parts": entries,
    }
    write_files(order.out, {SUMMARY: json.dumps(summary, indent=2, allow_nan=False)})
    if together is not None:
        lines.append(f"together: photos: {photos_words(asdict(together))}")
        lines += [f"  - {fault}" for fault in faults]
    lines.append(f"Written to {harmless(str(order.out))}: {SUMMARY}, and in each part's folder {', '.join(FILES)}")
    answer(summary, lines, as_json=as_json)
    return bool(summary["certified"] and summary["feasible"])


def _part_lines(folder: str, part: _Planned) -> list[str]:
    summary = part.summary
    verdict, *rest = verdict_lines(summary)
    return [
        f"{folder}, {part.lines.words}: {verdict}",
        rest[0],
        f"  {metres(summary['length_m'], 0)} long, {duration(summary['duration_s'])} of the "
        f"{duration(summary['usable_endurance_s'])} the battery gives, "
        f"{summary['items']} of {summary['max_items']} items",
        *(line for line in rest if line.startswith("  - ")),
    ]


def _together(coverages: list[SurveyCoverage | None]) -> SurveyCoverage | None:
    """What the photos of all parts see at least: each place by those of its own part, though others may show it too.

    Shares are of the whole area, overlaps and ground sampling distance those of the worst part.
    """
    known = [coverage for coverage in coverages if coverage is not None]
    if not known:
        return None
    area_m2 = sum(each.area_m2 for each in known)

    def share(of: Callable[[SurveyCoverage], float]) -> float:
        return sum(of(each) * each.area_m2 for each in known) / area_m2

    return replace(
        known[0],
        area_m2=area_m2,
        photos=sum(each.photos for each in known),
        photographed_share=share(lambda each: each.photographed_share),
        twice_share=share(lambda each: each.twice_share),
        front_overlap=min(each.front_overlap for each in known),
        side_overlap=min(each.side_overlap for each in known),
        gsd_cm=max(each.gsd_cm for each in known),
    )
