"""Recordings: started and stopped, kept, brought in and taken out, made of bags of ROS, and opened for review."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request
from fastapi.responses import FileResponse, Response
from pydantic import RootModel

from server.api.access import DONE, ERROR_RESPONSES, All, Fly, InCharge, answer, parts_of
from server.api.terrain_routes import RAW_BODY, FileName
from server.door.uploads import display_name, stream_to_disk, suffix_of
from server.flying.apart.recordings_there import FRESH_S, PRESSED_S
from server.library.recording_list import suffix_of_recording
from server.schemas import (
    BagDoc,
    BagRecordedDoc,
    BagRecordingBody,
    OpenReview,
    PlayReview,
    RecordingDoc,
    RecordingsThereDoc,
)

router = APIRouter(prefix="/api", tags=["recordings"], responses=ERROR_RESPONSES)


StationName = Annotated[str, Path(max_length=24)]
Fresh = Annotated[float, Query(ge=PRESSED_S, le=3600.0)]
Sha256 = Annotated[str, Path(pattern="^[0-9a-f]{64}$")]


class Recordings(RootModel[list[RecordingDoc]]):
    """Newest first."""


class Bags(RootModel[list[BagDoc]]):
    """Newest first."""


@router.post("/recorder/start", **DONE)
async def start(operator: InCharge, flying: Fly) -> None:
    """Records from now on, armed or not."""
    del operator
    await flying.recording.start()


@router.post("/recorder/stop", **DONE)
async def stop(operator: InCharge, flying: Fly) -> None:
    del operator
    await flying.recording.stop()


@router.get("/recordings", response_model=Recordings)
async def recordings(fleet: All) -> Response:
    return answer(Recordings(await fleet.recordings.docs()))


@router.post("/recordings/import", response_model=RecordingDoc, openapi_extra=RAW_BODY)
async def add(request: Request, fleet: All, filename: Annotated[str, Query(max_length=1000)]) -> Response:
    """An ``.mcap`` of Hedgehop's, a ``.tlog`` of any ground station, a ``.bin`` or ``.ulg`` of the vehicle's own."""
    name = display_name(filename)
    suffix = suffix_of_recording(name)
    upload = await stream_to_disk(request, parts_of(request).library.new_upload(suffix))
    return answer(await fleet.recordings.add(upload, name))


@router.get("/recordings/{recording_id}/file", response_class=FileResponse)
async def download(recording_id: str, fleet: All) -> Response:
    path = fleet.shelf.path(recording_id)
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.delete("/recordings/{recording_id}", **DONE)
async def delete(recording_id: str, fleet: All) -> None:
    """409 for the one that is being written."""
    await fleet.recordings.delete(recording_id)


@router.get("/stations/recordings", response_model=RecordingsThereDoc)
async def recordings_there(fleet: All, ask: bool = False, fresh_s: Fresh = FRESH_S) -> Response:
    """Of other stations, as far as they are listed. ``ask``: has those that are heard asked for lists that are older
    than ``fresh_s``; the stream says when these have come. 409 where no others are met."""
    if ask:
        await fleet.recordings_there.look(fresh_s)
    return answer(fleet.recordings_there.doc())


@router.post("/stations/{station}/recordings/{sha256}", **DONE)
async def fetch_recording(station: StationName, sha256: Sha256, fleet: All) -> None:
    """Fetches one that is listed, behind all that is told of vehicles; one that failed goes on from what is there."""
    await fleet.recordings_there.fetch(station, sha256)


@router.delete("/stations/{station}/recordings/{sha256}", **DONE)
async def end_fetch(station: StationName, sha256: Sha256, fleet: All) -> None:
    """Cancels it and deletes what is there of it, or puts away why it failed."""
    del station
    await fleet.recordings_there.end(sha256)


@router.post("/review/open", **DONE)
async def open_review(body: OpenReview, fleet: All) -> None:
    """Reads a recording, judges it against its plan, and makes it ready to be played."""
    await fleet.reviewing.open(body)


@router.post("/review/close", **DONE)
async def close_review(fleet: All) -> None:
    await fleet.reviewing.close()


@router.post("/review/play", **DONE)
async def play(body: PlayReview, fleet: All) -> None:
    """Plays, pauses, seeks, changes speed. Nothing that is replayed can reach a vehicle."""
    await fleet.reviewing.play(body)


@router.get("/bags", response_model=Bags)
async def bags(fleet: All) -> Response:
    """Those that are kept."""
    return answer(Bags(fleet.bags.docs()))


@router.post("/bags", response_model=BagDoc, openapi_extra=RAW_BODY)
async def add_bag(request: Request, fleet: All, filename: FileName) -> Response:
    """A ``.bag`` of ROS 1, an ``.mcap`` or ``.db3`` of ROS 2, or a ZIP archive of a bag's folder; told by the content.

    Answers with its topics once it has been read through; the job can be cancelled.
    """
    name = display_name(filename)
    upload = await stream_to_disk(request, parts_of(request).library.new_upload(suffix_of(name)))
    return answer(await fleet.bags.add(upload, name))


@router.post("/bags/{bag_id}/recording", response_model=BagRecordedDoc)
async def record_bag(bag_id: str, body: BagRecordingBody, fleet: All) -> Response:
    """Makes a recording of it, which joins the others; the bag is kept, for another sensor.

    422 with what is missing, and what there is instead.
    """
    return answer(await fleet.bags.record(bag_id, body))


@router.delete("/bags/{bag_id}", **DONE)
async def forget_bag(bag_id: str, fleet: All) -> None:
    """409 while a recording is being made of it."""
    await fleet.bags.forget(bag_id)
