"""Tables of the documents against the code: topics, requests, routes, messages, settings, words."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import get_args

import fastapi.routing
import pytest

import server.web
from planning.basics.plan_model import Camera, VehicleProfile
from server.errors import HTTP_CODES, STATUS
from server.schemas.page_messages import ClientMessage
from server.schemas.stream import ServerMessage
from telemetry.bus.encoding import EACH_ARRIVES
from telemetry.topics.messages import MESSAGE_TYPES, REPLAY_PREFIX
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.recording_requests import RecorderRequest, ReplayRequest
from telemetry.topics.requests import LinkRequest, PerceptionRequest
from telemetry.topics.station_recordings import RecordingsRequest
from tests.conftest import ROOT
from tests.docs.pages import code_names, rows, text_of

SOURCES = ("mapping", "planning", "telemetry", "server", "web/src")


def test_bus_topics_are_those_of_the_code() -> None:
    told = {code_names(topic)[0]: (code_names(message)[0], arrives) for topic, message, arrives, *_ in _topics()}
    assert told == {
        str(topic): (cls.__name__, "each" if topic in EACH_ARRIVES else "latest")
        for topic, cls in MESSAGE_TYPES.items()
    }
    assert f"`{REPLAY_PREFIX}`" in text_of("bus")


def _topics() -> list[list[str]]:
    return rows("bus", "topic")


def test_requests_of_the_nodes_are_those_of_the_code() -> None:
    told = {tuple(code_names(node)): set(code_names(answers)) for node, answers in rows("bus", "node")}
    assert told == {
        ("link",): _names(LinkRequest),
        ("radar", "vision", "ranges"): _names(PerceptionRequest),
        ("recorder",): _names(RecorderRequest),
        ("replay",): _names(ReplayRequest),
        ("stations",): _names(RecordingsRequest),
    }


def _names(requests: object) -> set[str]:
    return {cls.__name__ for cls in get_args(requests) or (requests,) if isinstance(cls, type)}


def test_every_route_is_in_the_page_and_every_route_of_the_page_exists() -> None:
    there = {
        f"{method} {route.path}"
        for module in server.web.ROUTERS
        for route in module.router.routes
        if isinstance(route, fastapi.routing.APIRoute)
        for method in route.methods or ()
    }
    told = [code_names(request)[0] for request, _ in rows("api", "request")]
    assert len(told) == len(set(told))
    also = {"GET /view/{page_id}/"}  # stands in a sentence
    assert all(f"`{request}`" in text_of("api") for request in also)
    assert set(told) | also == there


def test_every_websocket_is_in_the_page() -> None:
    sockets = {
        route.path
        for module in server.web.ROUTERS
        for route in module.router.routes
        if isinstance(route, fastapi.routing.APIWebSocketRoute)
    }
    assert sockets
    text = text_of("api")
    assert all(f"`{path}`" in text or f"`GET {path}`" in text for path in sockets)


@pytest.mark.parametrize(("header", "union"), [("from the server", ServerMessage), ("from a page", ClientMessage)])
def test_messages_of_the_stream_are_those_of_the_code(header: str, union: object) -> None:
    told = {code_names(kind)[0]: code_names(names) for kind, names, _ in rows("api", header)}
    messages = get_args(get_args(union)[0])
    assert told == {
        cls.model_fields["type"].default: [name for name in cls.model_fields if name not in ("v", "type")]
        for cls in messages
    }


def test_statuses_are_those_of_the_code() -> None:
    told = {int(number) for cell, _ in rows("api", "status") for number in cell.split(",")}
    assert set(STATUS.values()) <= told <= set(STATUS.values()) | set(HTTP_CODES)


def test_keys_and_defaults_of_a_vehicle_profile_are_those_of_the_code() -> None:
    defaults = {field.name: field.default for field in fields(VehicleProfile)}
    table = rows("vehicle-profile", "key")
    for keys, default, _ in table:
        numbers = [float(part) for part in default.split(", ") if re.fullmatch(r"[\d.]+", part)]
        if numbers:
            assert numbers == [defaults[key] for key in code_names(keys)]
    told = {key for keys, _, what in table for key in [*code_names(keys), *code_names(what)]}
    cameras = {field.name for field in fields(Camera)}
    assert (set(defaults) - {"camera"}) | cameras <= told
    assert {key for keys, *_ in table for key in code_names(keys)} - {"[camera]"} <= set(defaults)


def test_settings_of_the_maps_are_those_of_the_code() -> None:
    told = {name for setting, *_ in rows("maps", "setting") for name in code_names(setting)}
    assert told <= {field.name for field in fields(PerceptionSettings)}


def test_words_of_the_glossary_stand_in_the_code() -> None:
    files = [path for folder in SOURCES for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".ts", ".tsx")]
    names = {name for path in files for name in re.findall(r"\w+", path.read_text(encoding="utf-8"))}
    told = [name for *_, spelled in rows("glossary", "word") for name in code_names(spelled)]
    assert len(told) > 50
    assert [name for name in told if name not in names] == []
