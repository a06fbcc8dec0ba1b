"""Messages as JSON: nothing is lost, and viewers find one type per field."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.schemas import codec_of, json_schema
from telemetry.topics.messages import MESSAGE_TYPES, PlanRecord, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import PLAN

KINDS = sorted(set(MESSAGE_TYPES.values()), key=lambda kind: kind.__name__)
st.register_type_strategy(float, st.floats(allow_nan=False, allow_infinity=False))
st.register_type_strategy(int, st.integers(min_value=-(2**53), max_value=2**53))
st.register_type_strategy(str, st.text(st.characters(exclude_categories=["Cs"]), max_size=20))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(data=st.data())
def test_every_message_comes_back_as_it_was(kind: type, data: st.DataObject) -> None:
    message = data.draw(st.from_type(kind))
    codec = codec_of(kind)
    assert codec.decode(codec.encode(message)) == message


def each_field(schema: dict[str, Any]) -> list[dict[str, Any]]:
    inner = [*schema.get("properties", {}).values(), *([schema["items"]] if "items" in schema else [])]
    return [schema, *(field for part in inner for field in each_field(part))]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_schemas_have_one_plain_type_per_field(kind: type) -> None:
    """What Foxglove's reader of JSON Schema understands: no references, no unions, no null."""
    plain = {"object", "array", "string", "number", "integer", "boolean"}
    fields = each_field(json.loads(codec_of(kind).schema))
    assert fields[0]["type"] == "object"
    assert all(field["type"] in plain and "$ref" not in field for field in fields)
    assert all("properties" in field for field in fields if field["type"] == "object")


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_nothing_in_the_json_is_null(kind: type) -> None:
    examples = {PlanRecord: PLAN, VehicleState: VehicleState(1, 1)}
    if kind in examples:
        assert b"null" not in codec_of(kind).encode(examples[kind])
    assert "null" not in codec_of(kind).schema.decode()


def test_fields_that_newer_versions_added_do_not_hinder_reading() -> None:
    read = codec_of(VehicleText).decode(b'{"t_utc_s":1.5,"severity":6,"text":"hi","colour":"red"}')
    assert read == VehicleText(1.5, 6, "hi")


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b'{"t_utc_s":"now","severity":6,"text":"hi"}', b"\xff"])
def test_what_is_no_such_message_is_said(data: bytes) -> None:
    with pytest.raises(RecordingError, match="VehicleText"):
        codec_of(VehicleText).decode(data)


def test_a_type_that_no_viewer_could_show_is_refused_at_once() -> None:
    with pytest.raises(TypeError):
        json_schema(int | str)
