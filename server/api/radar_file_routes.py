"""Files of raw radar samples: brought in, opened, and looked at frame by frame.

Nothing here reaches a vehicle: whoever is signed in may look.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request
from fastapi.responses import Response
from pydantic import RootModel

from server.api.access import DONE, ERROR_RESPONSES, answer, parts_of
from server.api.terrain_routes import RAW_BODY, FileName
from server.door.uploads import display_name, stream_to_disk
from server.errors import BadRequestError, TooLargeError
from server.library.radar_files import ending_of
from server.schemas import (
    JobDoc,
    RadarFileDoc,
    RadarFrame,
    RadarOpened,
    RadarReading,
    RadarTracksBody,
    RadarTracksDoc,
)
from server.schemas.study_docs import PageName

router = APIRouter(prefix="/api/radar", tags=["radar"], responses=ERROR_RESPONSES)

CFG_LIMIT_BYTES = 1024**2


class RadarFiles(RootModel[list[RadarFileDoc]]):
    """Newest first."""


class NewestQuestion(RadarReading):
    """By a page, of which only the newest question counts."""

    page: PageName

    @property
    def how(self) -> RadarReading:
        return RadarReading(sensor=self.sensor, samples=self.samples, most=self.most)


@router.get("/files", response_model=RadarFiles)
async def files(request: Request) -> Response:
    """The stream tells what changes."""
    return answer(RadarFiles(parts_of(request).radar.message().files))


@router.post("/files", response_model=RadarFileDoc, openapi_extra=RAW_BODY)
async def add(request: Request, filename: FileName) -> Response:
    """A complex ``.npy``, a DCA1000 ``.bin`` or the ODA data set's ``radar.csv``."""
    name, parts = display_name(filename), parts_of(request)
    upload = await stream_to_disk(request, parts.library.new_upload(ending_of(name)))
    return answer(await parts.radar.add(upload, name))


@router.put("/files/{file_id}/cfg", response_model=RadarFileDoc, openapi_extra=RAW_BODY)
async def set_cfg(file_id: str, request: Request, filename: FileName) -> Response:
    """The configuration that a TI radar ran with."""
    data = await request.body()
    if not data:
        raise BadRequestError("The configuration is empty.", where=display_name(filename))
    if len(data) > CFG_LIMIT_BYTES:
        what = f"{display_name(filename)} is larger than 1 MiB: that is no radar's configuration."
        raise TooLargeError(what, where=display_name(filename), advice="Choose its .cfg.")
    return answer(await parts_of(request).radar.set_cfg(file_id, data, display_name(filename)))


@router.delete("/files/{file_id}/cfg", response_model=RadarFileDoc)
async def remove_cfg(file_id: str, request: Request) -> Response:
    return answer(await parts_of(request).radar.set_cfg(file_id, None))


@router.put("/files/{file_id}/capture", response_model=RadarFileDoc, openapi_extra=RAW_BODY)
async def set_capture(file_id: str, request: Request, filename: FileName) -> Response:
    """The ODA data set's ``optitrack.csv`` of the same flight."""
    name, parts = display_name(filename), parts_of(request)
    upload = await stream_to_disk(request, parts.library.new_upload(".csv"))
    return answer(await parts.radar.set_capture(file_id, upload, name))


@router.delete("/files/{file_id}/capture", response_model=RadarFileDoc)
async def remove_capture(file_id: str, request: Request) -> Response:
    return answer(await parts_of(request).radar.set_capture(file_id, None))


@router.post("/files/{file_id}/tracks", response_model=JobDoc, status_code=202)
async def follow(file_id: str, body: RadarTracksBody, request: Request) -> Response:
    """A job that follows what the samples show and holds it against the capture and the poles' places."""
    parts = parts_of(request)
    return answer(parts.radar.follow(file_id, body, parts.workspace.board), 202)


@router.get("/files/{file_id}/tracks", response_model=RadarTracksDoc)
async def tracks(file_id: str, request: Request) -> Response:
    """What the last such job came to, figure by figure beside the paper's."""
    return answer(await parts_of(request).radar.tracks(file_id))


@router.delete("/files/{file_id}", **DONE)
async def delete(file_id: str, request: Request) -> None:
    await parts_of(request).radar.delete(file_id)


@router.get("/files/{file_id}/open", response_model=RadarOpened)
async def open_file(file_id: str, request: Request, asked: Annotated[NewestQuestion, Query()]) -> Response:
    """Reads it through: how many frames, of which radar; 409 when the page has asked for something else meanwhile."""
    return answer(await parts_of(request).radar.open(asked.page, file_id, asked.how))


@router.get("/files/{file_id}/frames/{number}", response_model=RadarFrame)
async def frame(
    file_id: str, number: Annotated[int, Path(ge=0)], request: Request, asked: Annotated[NewestQuestion, Query()]
) -> Response:
    """Range-Doppler map, range-azimuth map and detections of one frame."""
    return answer(await parts_of(request).radar.frame(asked.page, file_id, asked.how, number))
