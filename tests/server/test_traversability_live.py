"""A UWB radar that scans now: fused as it comes, its silence told, its rule changed, its drive begun anew."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from mapping.uwb.uwb_params import of_rule
from planning.errors import FormatError
from planning.ground.traversable import UwbScans
from planning.terrain.geotiff import write_dsm
from server.door.sensor_token import sensor_token
from server.library import Library
from server.schemas import TraversabilityState, UwbLiveDoc
from server.settings import RUNTIME_FOLDER
from server.traversability.live_uwb import AGAIN_S, SILENT_S, LiveUwb
from telemetry.agent.client import Agent
from telemetry.agent.link_messages import Uwb
from telemetry.bus.bus import Bus
from telemetry.topics.messages import Topic, VehicleText
from tests.server.scene_fixtures import hill
from tests.server.station import Station, ok, station
from tests.server.test_traversability_maps import scans
from tests.telemetry.uwb_drives import scan_of, state_of

pytestmark = pytest.mark.xdist_group("process")
HERE = (-37.0, 175.0)


class FakeDesk:
    def __init__(self) -> None:
        self.open_terrain_id: str | None = "hill"
        self.told: list[UwbLiveDoc] = []
        self.fused: list[tuple[str, bool, Any]] = []
        self.error: Exception | None = None

    def tell_live(self, live: UwbLiveDoc) -> None:
        self.told.append(live)

    async def clear_live(self, log: Path, name: str, params: Any) -> None:
        self.fused.append((name, log.is_file(), params))
        if self.error is not None:
            raise self.error


class Bench:
    def __init__(self, root: Path) -> None:
        self.desk, self.notices, self.now_s, self.made, self.root = FakeDesk(), [], 100.0, 0, root
        self.live = LiveUwb(cast(Any, self.desk), cast(Library, self), cast(Any, self), now_mono_s=lambda: self.now_s)

    def publish(self, topic: str, text: VehicleText) -> None:
        """As the bus does."""
        assert topic == Topic.TEXT
        self.notices.append(text)

    def new_upload(self, suffix: str) -> Path:
        self.made += 1
        return self.root / f"{self.made}{suffix}"

    def scan(self, count: int = 1, bins: int = 16) -> None:
        for _ in range(count):
            self.now_s += 0.1
            self.live.on_scan(scan_of(0, self.now_s, np.ones(bins)))
            self.live.on_state(state_of(self.now_s, *HERE, 0.0))

    @property
    def said(self) -> UwbLiveDoc:
        self.live.tick()
        return self.desk.told[-1]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_nothing_is_said_before_the_first_scan(bench: Bench) -> None:
    bench.live.on_state(state_of(100.0, *HERE, 0.0))
    assert bench.said == UwbLiveDoc()
    bench.now_s += 100.0
    assert (bench.said.state, bench.notices) == ("none", [])


def test_its_silence_is_told_to_page_and_pilot_and_so_is_its_return(bench: Bench) -> None:
    bench.scan(60)
    assert (bench.said.state, bench.said.source, bench.said.scans, bench.said.per_s) == ("live", "rover", 60, 10.2)
    bench.now_s += SILENT_S + 1.0
    assert (bench.said.state, bench.said.silent_s, bench.said.per_s) == ("silent", 3, 0.0)
    bench.now_s += 60.0
    assert bench.said.silent_s == 63
    assert [(notice.severity, notice.text) for notice in bench.notices] == [(4, "rover: UWB radar: No scans for 2 s.")]
    bench.scan()
    assert bench.said.state == "live"
    assert bench.notices[-1] == VehicleText(bench.notices[-1].t_utc_s, 6, "rover: UWB radar: It scans again.")


def test_it_is_fused_when_there_is_something_new_and_not_too_often(bench: Bench) -> None:
    bench.scan(3)
    assert bench.live._is_due(bench.now_s)
    asyncio.run(bench.live.fuse())
    assert [(name, there) for name, there, _ in bench.desk.fused] == [("rover, live", True)]
    assert list(bench.root.iterdir()) == []
    assert not bench.live._is_due(bench.now_s)
    bench.scan()
    assert bench.live._is_due(bench.now_s)
    bench.live._next_s = bench.now_s + AGAIN_S
    assert not bench.live._is_due(bench.now_s)
    bench.desk.open_terrain_id = None
    assert not bench.live._is_due(bench.now_s + 2 * AGAIN_S)


def test_another_rule_fuses_all_scans_anew_and_what_stands_against_it_is_told(bench: Bench) -> None:
    bench.scan(3)
    asyncio.run(bench.live.fuse())
    paper = of_rule("paper")
    bench.live.set_params(paper)
    assert bench.live._is_due(bench.now_s)
    bench.desk.error = FormatError("Too few scans look at open ground.")
    asyncio.run(bench.live.fuse())
    assert bench.desk.fused[-1][2] == paper
    assert bench.said.problem == "Too few scans look at open ground."
    bench.desk.error = None
    asyncio.run(bench.live.fuse())
    assert bench.said.problem == ""


def test_put_away_it_begins_anew(bench: Bench) -> None:
    bench.scan(3)
    bench.live.clear()
    assert bench.said == UwbLiveDoc()
    bench.scan(2, bins=32)
    assert (bench.said.scans, bench.said.other_geometry) == (2, 0)


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Station]:
    with station(tmp_path, flies=True) as made:
        write_dsm(tmp_path / "hill.tif", hill())
        assert made.upload("hill.tif", (tmp_path / "hill.tif").read_bytes()).state == "done"
        yield made


def walk() -> UwbScans:
    along = np.column_stack([np.linspace(500_060.0, 500_062.0, 60), np.full(60, 3_999_942.0)])
    return scans(hill().lat_lon_from_xy(along))


LEAD, BEAT_S = 25, 0.06
"""Positions that are said before the scan of the first of them."""


def _uwb(log: UwbScans, k: int, t_mono_s: float) -> Uwb:
    return Uwb(0, t_mono_s, log.intensity[k].astype("<f4").tobytes(), log.geometry.bin_m)


async def _is_heard(page: Station, bus: Bus, log: UwbScans) -> None:
    """Positions that are published before would be lost but for the last."""
    lat_deg, lon_deg = log.lat_lon_deg[0].tolist()
    bus.publish(Topic.VEHICLE, state_of(time.monotonic() - 6.5, lat_deg, lon_deg, float(log.heading_rad[0])))
    await asyncio.to_thread(page.until, lambda m: m.type == "vehicle" and m.state is not None)


async def scan_over_sockets(page: Station) -> None:
    """A simulated radar behind a real agent, and its vehicle on the bus, as the link's node puts it there."""
    log, token = walk(), sensor_token(page.server.settings.data_dir)
    agent = Agent(page.server.origin, token=token, name="rover")
    bus = await Bus.open(page.server.settings.data_dir / RUNTIME_FOLDER, "walk")
    running_agent = asyncio.ensure_future(agent.run())
    try:
        async with asyncio.timeout(120):
            while not agent.is_ready:
                await asyncio.sleep(0.02)
            await _is_heard(page, bus, log)
            begun_s = time.monotonic() - 6.0
            times_s = [begun_s + t_s for t_s in log.t_s.tolist()]
            for k, t_s in enumerate(times_s):
                lat_deg, lon_deg = log.lat_lon_deg[k].tolist()
                bus.publish(Topic.VEHICLE, state_of(t_s, lat_deg, lon_deg, float(log.heading_rad[k])))
                # Scans and positions come by two ways: time flies here, and a scan waits a second for its position.
                if k >= LEAD:
                    agent.put(_uwb(log, k - LEAD, times_s[k - LEAD]))
                await asyncio.sleep(BEAT_S)
            for k in range(len(times_s) - LEAD, len(times_s)):
                agent.put(_uwb(log, k, times_s[k]))
                await asyncio.sleep(BEAT_S)
            while agent.counts.report is None or agent.counts.report.received < len(log.t_s):
                await asyncio.sleep(0.02)
            assert agent.counts.report.refused == 0
    finally:
        running_agent.cancel()
        await asyncio.gather(running_agent, return_exceptions=True)
        await bus.close()


@pytest.mark.slow
def test_scans_over_real_sockets_clear_the_open_model_and_their_end_is_told(page: Station) -> None:
    asyncio.run(scan_over_sockets(page))
    # A first fusion may have had too few scans; that is told until the next tick.
    fused = said(page, lambda s: s.uwb_log == "rover, live" and s.scans >= 55 and s.live.problem == "")
    assert (fused.state, fused.live.source, fused.live.unplaced) == ("ready", "rover", 0)
    silent = said(page, lambda state: state.live.state == "silent")
    assert silent.uwb_log == "rover, live"
    changed = ok(page.http.put("/api/traversability/uwb/live", params={"rule": "paper", "p_o": 0.7}))
    assert "paper" in TraversabilityState.model_validate_json(changed.text).live.rule
    again = said(page, lambda state: "paper" in state.uwb_rule)
    assert again.scans == fused.scans or again.scans > 55
    refused = page.http.put("/api/traversability/uwb/live", params={"p_o": 0.2})
    assert refused.status_code == 422
    ok(page.http.delete("/api/traversability"))
    gone = said(page, lambda state: state.state == "none")
    assert gone.live == UwbLiveDoc()


def said(page: Station, wanted: Callable[[TraversabilityState], bool]) -> TraversabilityState:
    return page.until(lambda m: m.type == "traversability" and wanted(m.traversability)).traversability
