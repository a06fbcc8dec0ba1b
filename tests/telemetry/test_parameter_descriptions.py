"""What the autopilot's makers say of parameters, read from their own files, written here in their manner."""

from __future__ import annotations

import json
import lzma

import pytest

from planning.errors import FormatError
from telemetry.parameters.described import Description, read_descriptions

ARDUPILOT = """<?xml version="1.0" encoding="utf-8"?>
<!-- made by hand for this test -->
<paramfile><vehicles><parameters name="ArduCopter">
<param humanName="Height of return" name="ArduCopter:RTL_ALT" documentation="How high  it
 returns." user="Standard"><field name="Range">200 300000</field><field name="Units">cm</field></param>
</parameters></vehicles><libraries><parameters name="FENCE_">
<param humanName="Fence" name="FENCE_ACTION" documentation="What it does."><field name="RebootRequired">True</field>
<values><value code="0">Report</value><value code="1">Return</value></values></param>
<param name="FENCE_TYPE"><field name="Bitmask">0:Height,1:Circle,2:Polygon</field><field name="Range">1 to 5</field>
</param></parameters></libraries></paramfile>"""
PX4 = {
    "version": 1,
    "parameters": [
        {
            "name": "RTL_RETURN_ALT", "type": "Float", "default": 60.0, "min": 0, "max": 1e3, "units": "m",
            "shortDesc": "Height of return", "longDesc": "How high.", "values": [{"value": -1, "description": "None"}],
            "bitmask": [{"index": 1, "description": "One"}], "rebootRequired": True,
        },
        {"name": "BARE"}, {"no": "name"}, 7,
    ],
}  # fmt: skip


def test_ardupilots() -> None:
    found = read_descriptions("apm.pdef.xml", ARDUPILOT.encode())
    assert list(found) == ["RTL_ALT", "FENCE_ACTION", "FENCE_TYPE"]
    height = found["RTL_ALT"]
    assert (height.title, height.text, height.unit) == ("Height of return", "How high it returns.", "cm")
    assert (height.low, height.high, height.default) == (200.0, 300_000.0, None)
    assert found["FENCE_ACTION"].meaning(1.0) == "Return"
    assert found["FENCE_ACTION"].reboot
    assert found["FENCE_TYPE"].meaning(6.0) == "Circle + Polygon"
    assert found["FENCE_TYPE"].meaning(9.0) == "Height + bit 3"
    assert found["FENCE_TYPE"].low is None


@pytest.mark.parametrize("packed", [False, True])
def test_px4s(packed: bool) -> None:
    data = json.dumps(PX4).encode()
    found = read_descriptions("parameters.json", lzma.compress(data) if packed else data)
    assert list(found) == ["RTL_RETURN_ALT", "BARE"]
    height = found["RTL_RETURN_ALT"]
    assert (height.title, height.unit, height.low, height.high, height.default) == (
        "Height of return", "m", 0.0, 1000.0, 60.0,
    )  # fmt: skip
    assert height.reboot
    assert height.meaning(-1.0) == "None"
    assert height.outside(-1.0)
    assert not height.outside(30.0)
    assert found["BARE"] == Description()


def test_searching_and_values_without_a_meaning() -> None:
    described = Description("Return", "How HIGH it is.")
    assert described.has("high")
    assert not described.has("low")
    assert described.meaning(3.0) == ""
    assert not described.outside(1e9)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"<paramfile/>",
        b"<html/>",
        b"<paramfile><param",
        b'<!DOCTYPE x [<!ENTITY a "b">]><paramfile/>',
        b"{}",
        b'{"parameters": {}}',
        b"{",
        lzma.compress(json.dumps(PX4).encode())[:-20],
        b"\xfd7zXZ\x00rubbish",
        lzma.compress(b" " * (21 * 1024 * 1024)),
    ],
)
def test_what_is_no_such_file(data: bytes) -> None:
    with pytest.raises(FormatError):
        read_descriptions("x", data)
