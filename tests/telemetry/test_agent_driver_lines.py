"""A driver's lines: good ones become readings, bad ones are counted and told; only nothing but bad ones is the end."""

from __future__ import annotations

import io
import json
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.agent.client import CloudReading, NoticeReading, RadarReading, Reading
from telemetry.agent.driver_lines import HOPELESS, NOTICE_EVERY_S, BadLineError, DriverLines, reading_of
from telemetry.agent.link_messages import Slam, Uwb
from telemetry.errors import SensorLinkError

GOOD = b'{"type": "radar", "t_s": 1, "targets": [[1, 2, 3, 4, 5]]}'
BAD = b'{"type": "radar", "targets": [[1, 2'


class Driver:
    """``DriverLines`` of a few lines, on a clock that goes on by ``step_s`` whenever it is looked at."""

    def __init__(self, *lines: bytes, step_s: float = 0.0) -> None:
        self.told: list[str] = []
        self._now_s, self._step_s = 100.0, step_s
        self.lines = DriverLines(io.BytesIO(b"\n".join(lines) + b"\n"), tell=self.told.append, now=self._now)

    def _now(self) -> float:
        self._now_s += self._step_s
        return self._now_s

    def readings(self) -> list[Reading]:
        return list(self.lines.readings())


def test_lines_become_readings() -> None:
    driver = Driver(
        GOOD,
        b"",
        b'{"type": "cloud", "t_s": 2, "points": []}',
        b'{"type": "slam", "position_m": [1, 2, 3], "q_wxyz": [1, 0, 0, 0]}',
        b'{"type": "uwb", "t_s": 3, "intensity": [1, 2, 3, 4, 5, 6, 7, 8], "bin_m": 0.15, "bearing_deg": 10}',
    )
    radar, cloud, slam, uwb = driver.readings()
    assert isinstance(uwb, Uwb)
    assert (uwb.t_s, uwb.bin_m, uwb.bearing_deg) == (3.0, 0.15, 10.0)
    assert np.frombuffer(uwb.intensity, "<f4").tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    assert isinstance(radar, RadarReading)
    assert radar.targets.tolist() == [[1, 2, 3, 4, 5]]
    assert isinstance(cloud, CloudReading)
    assert cloud.xyz_m.shape == (0, 3)
    assert isinstance(slam, Slam)
    assert (slam.t_s, slam.tracking) == (100.0, "good")
    assert driver.told == []
    assert driver.lines.counts.as_dict() == {"good": 4, "bad": 0, "reasons": {}, "last_bad": ""}


@pytest.mark.parametrize(
    ("line", "kind"),
    [(b"[]", "no JSON object"), (b"{", "no JSON"), (b"\xff\xfe{}", "no JSON"), (b"[" * 100_000, "no JSON"),
     (b'{"type": "sonar"}', "unknown type"), (b'{"type": ["radar"], "targets": []}', "unknown type"),
     (b'{"targets": []}', "a field is missing"), (b'{"type": "radar"}', "a field is missing"),
     (b'{"type": "radar", "targets": [[1, 2]]}', "wrong values"),
     (b'{"type": "radar", "targets": {"x": 1}}', "wrong values"),
     (b'{"type": "cloud", "points": [1, 2]}', "wrong values"),
     (b'{"type": "cloud", "points": [[1, 2, ' + b"9" * 400 + b"]]}", "wrong values"),
     (b'{"type": "slam", "position_m": [1], "q_wxyz": [1, 0, 0, 0]}', "wrong values"),
     (b'{"type": "uwb"}', "a field is missing"),
     (b'{"type": "uwb", "intensity": [[1, 2]]}', "wrong values"),
     (b'{"type": "uwb", "intensity": [1, 2, 3, 4, 5, 6, 7]}', "wrong values"),
     (b'{"type": "uwb", "intensity": [1, 2, 3, 4, 5, 6, 7, null]}', "wrong values"),
     (b'{"type": "uwb", "intensity": [1, 2, 3, 4, 5, 6, 7, 8], "bin_m": "x"}', "wrong values"),
     (b'{"type": "radar", "t_s": "x", "targets": []}', "wrong values"),
     (b'{"type": "radar", "t_s": NaN, "targets": []}', "wrong values"),
     (b'{"type": "slam", "position_m": [1, 2, 3], "q_wxyz": [1, 0, 0, 0], "tracking": "fine"}', "wrong values")],
)  # fmt: skip
def test_a_bad_line_is_counted_told_and_left_out(line: bytes, kind: str) -> None:
    driver = Driver(GOOD, line, GOOD)
    before, notice, after = driver.readings()
    assert isinstance(before, RadarReading)
    assert isinstance(after, RadarReading)
    assert isinstance(notice, NoticeReading)
    assert notice.warning
    assert notice.text.startswith(f"driver: A bad line was left out. The last: line 2, {kind}: ")
    assert len(driver.told) == 1
    assert driver.told[0].startswith(f"Line 2 is left out, {kind}: ")
    assert "docs/agent.md" in driver.told[0]
    counts = driver.lines.counts
    assert (counts.good, dict(counts.bad)) == (2, {kind: 1})
    assert f"good lines 2, bad ones 1 (1 {kind}); the last: line 2, {kind}: " in str(counts)


def test_numbers_too_large_for_the_wire_are_no_bad_line() -> None:
    (cloud,) = Driver(b'{"type": "cloud", "points": [[1e300, 0, 0]]}').readings()
    assert isinstance(cloud, CloudReading)
    assert math.isinf(cloud.xyz_m[0, 0])


def test_each_kind_is_told_once_and_the_pilot_now_and_then() -> None:
    driver = Driver(GOOD, *[BAD] * 30, b"[]", *[BAD] * 30, GOOD, step_s=0.1)
    found = driver.readings()
    assert [text.split(",")[0] for text in driver.told] == ["Line 2 is left out", "Line 32 is left out"]
    notices = [reading for reading in found if isinstance(reading, NoticeReading)]
    assert 1 < len(notices) < 10
    assert all(b.t_s - a.t_s >= NOTICE_EVERY_S for a, b in pairwise(notices))
    assert "bad lines were left out" in notices[-1].text
    assert driver.lines.counts.as_dict()["reasons"] == {"no JSON": 60, "no JSON object": 1}
    assert isinstance(found[-1], RadarReading)


def test_nothing_but_bad_lines_is_the_end_and_says_why() -> None:
    driver = Driver(*[BAD] * (HOPELESS - 1), GOOD, *[BAD] * (2 * HOPELESS))
    assert sum(isinstance(reading, RadarReading) for reading in driver.readings()) == 1
    for lines, count in (([BAD] * HOPELESS + [GOOD], HOPELESS), ([BAD] * 3, 3)):
        with pytest.raises(SensorLinkError, match=f"None of the first {count} lines is a reading") as caught:
            Driver(*lines).readings()
        assert f"line {count}, no JSON: " in caught.value.what
        assert "docs/agent.md" in caught.value.advice


def test_a_driver_that_says_nothing_has_done_nothing_wrong() -> None:
    assert Driver(b"", b"  ").readings() == []


@given(st.binary(max_size=200) | st.recursive(
    st.none() | st.floats() | st.integers() | st.text(max_size=5) | st.sampled_from(["radar", "cloud", "slam"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(
        st.sampled_from(["type", "t_s", "targets", "points", "position_m", "q_wxyz", "tracking"]), inner),
).map(lambda value: json.dumps(value).encode()))  # fmt: skip
def test_no_line_does_more_than_being_bad(line: bytes) -> None:
    try:
        reading_of(line, now_s=1.0)
    except BadLineError as error:
        assert error.kind  # noqa: PT017 - it may be a reading by chance
