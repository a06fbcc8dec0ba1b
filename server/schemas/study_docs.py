"""Looked at in Review beside recordings: files of raw radar samples, and scenarios."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from planning.basics.limits import LARGEST_SEED
from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Asked, Strict

RadarSensor = Literal["awr1843", "position2go"]
SamplesAs = Literal["auto", "twos-complement", "offset-binary"]
PageName = Annotated[str, Field(max_length=64)]


class RadarFileDoc(Strict):
    """A file of raw samples that is kept."""

    id: str
    name: str
    bytes: int
    added_utc: str
    cfg_name: str = ""
    """Of the configuration that was given with it; empty: none."""
    capture_name: str = ""
    """Of the OptiTrack file that was given with it; empty: none."""
    has_tracks: bool = False
    """Whether it has been held against that capture."""


class RadarReading(Strict):
    """What a file does not tell itself; as on the command line."""

    sensor: RadarSensor | None = None
    """Null: a Position2Go's for .csv, else an AWR1843's."""
    samples: SamplesAs = "auto"
    most: Annotated[int, Field(ge=1), Asked(max=1_000_000)] | None = None
    """Only the first so many frames."""


class RadarParametersDoc(Strict):
    """What the frames are taken for."""

    sensor: RadarSensor
    chirps: int
    antennas: int
    samples: int
    start_frequency_hz: float
    slope_hz_per_s: float
    sample_rate_hz: float
    chirp_interval_s: float
    frame_period_s: float
    wavelength_m: float
    range_resolution_m: float
    max_range_m: float
    velocity_resolution_m_s: float
    max_velocity_m_s: float


class RadarOpened(Strict):
    """A file that has been read through once."""

    file: RadarFileDoc
    frames: int
    parameters: RadarParametersDoc
    notes: list[str]
    """What was assumed or put right, a sentence each."""


class RadarDetectionDoc(Strict):
    range_m: float
    radial_speed_m_s: float
    """Positive: moving away."""
    azimuth_deg: float
    """Positive: to the right."""
    elevation_deg: float
    x_right_m: float
    y_forward_m: float
    z_up_m: float
    snr_db: float
    doppler_cell: int
    range_cell: int


class RadarMap(Strict):
    """Power by two axes, in steps of a 255th of what lies between floor and top."""

    rows: int
    columns: int
    cells: str
    """Base64 of one byte per cell, row by row."""
    floor_db: float
    top_db: float
    first_row: float
    row_step: float
    first_column: float
    column_step: float
    """Where the middle of the first cell lies, and the next one's."""


class RadarFrame(Strict):
    """One frame, processed."""

    number: int
    t_s: float
    doppler: RadarMap
    """Rows: radial speed in m/s, ascending; columns: range in m."""
    azimuth: RadarMap | None
    """Rows: range in m; columns: sine of the azimuth, to the right; null where one antenna tells none."""
    detections: list[RadarDetectionDoc]


class PoleDoc(Strict):
    """Where a pole stood, in the capture's own metres."""

    x_m: Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
    z_m: Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]


class RadarTracksBody(Strict):
    """What the ODA data set's two files do not tell themselves; as on the command line."""

    poles: Annotated[list[PoleDoc], Field(min_length=1, max_length=20)]
    offset_s: Annotated[float, Field(ge=-86_400, le=86_400, allow_inf_nan=False)] = 0.0
    """So long after the capture's first row the radar's first frame was."""
    forward: Literal["x", "z", "-x", "-z"] = "x"
    """Which of the captured body's axes is its nose."""


class ScenarioDoc(Strict):
    """A field test of the papers in simulation."""

    name: str
    flown: str
    held: str
    paper: str
    command_line_only: bool
    """Too long for a browser."""


class ScenarioRunDoc(Strict):
    """A scenario that runs, or was run."""

    id: str
    name: str
    seed: int
    started_utc: str
    state: Literal["running", "done", "failed", "cancelled"]
    step: str = ""
    progress: float | None = None
    passed: bool | None = None
    """Whether every figure was reached; null until then."""
    seconds: float | None = None
    """That it took."""
    error: ErrorDoc | None = None


class ScenarioFigureDoc(Strict):
    words: str
    value: float | None
    """Null: there was nothing to measure it on, or no end to it."""
    unit: str
    least: float | None
    most: float | None
    verdict: Literal["reached", "NOT REACHED", "not measured"] | None
    """Null where nothing must be reached."""
    paper: str
    """What the paper prints of it."""


class SeriesDoc(Strict):
    name: str
    """Empty: of the one before it."""
    x: list[float]
    y: list[float]
    drawn: Literal["line", "points"]
    printed: bool
    """As the paper prints it."""


class ChartDoc(Strict):
    title: str
    x_label: str
    y_label: str
    x_span: tuple[float, float]
    y_span: tuple[float, float]
    is_true: bool
    """A drawing of places: as many metres in both directions."""
    series: list[SeriesDoc]


class ScenarioPartDoc(Strict):
    """One flight of it, or what else is measured."""

    title: str
    duration_s: float
    """0: nothing flew."""
    contact: bool
    min_true_distance_m: float | None
    alerts: int
    figures: list[ScenarioFigureDoc]
    notes: list[str]
    charts: list[ChartDoc]


class ScenarioResultDoc(Strict):
    run: ScenarioRunDoc
    parts: list[ScenarioPartDoc]


class RadarTracksDoc(Strict):
    """A radar's tracks against truth, as they were asked for."""

    asked: RadarTracksBody
    capture_name: str
    part: ScenarioPartDoc


class RunScenario(Strict):
    name: Annotated[str, Field(max_length=40)]
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 0
