"""A station whose file says not who it is: it flies without others, tells that, and tries again."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from server.door.alarms import Alarms
from server.door.certificates import CertificateFiles, now_utc
from server.door.station_files import write_station_files
from server.flying.apart import other_stations
from server.flying.apart.other_stations import Meeting, OtherStations
from server.flying.apart.others_heard import NODE_SILENT_S
from server.schemas import ServerMessage
from tests.server.test_other_stations import NOW_S
from tests.server.test_others_heard import GOOD

PATIENCE_S = 30.0


class Unmet:
    """``started``: what its node was started with."""

    def __init__(self, file: Path) -> None:
        self.told, self.started = list[ServerMessage](), list[tuple[Any, ...]]()
        hub: Any = SimpleNamespace(publish=self.told.append)
        self.alarms, none = Alarms(hub), None
        nodes: Any = SimpleNamespace(stations=self._start)
        bus: Any = none
        self.now_s = 0.0
        meeting = Meeting(("tls/router:7447",), file, file.with_name("fetched"))
        self.it = OtherStations(meeting, bus, nodes, hub, lambda: [], now_mono_s=lambda: self.now_s)

    async def _start(self, *with_those: Any) -> None:
        self.started.append(with_those)

    @property
    def texts(self) -> list[str]:
        return [f"{alarm.level}: {alarm.error.what}" for alarm in self.alarms.message.alarms]


@pytest.mark.parametrize(
    "content", [None, b"nothing", b"\xff\xfe", b"-----BEGIN A\n" * 3, b"-----BEGIN CERTIFICATE-----\nAAAA\n" * 3]
)
def test_its_crew_can_fly_is_told_and_others_are_not_passed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes | None
) -> None:
    file = tmp_path / "fleet" / "Alpha.pem"
    monkeypatch.setattr(other_stations, "LOOK_FOR_FILE_S", 0.01)

    async def whole() -> None:
        if content is not None:
            file.parent.mkdir()
            file.write_bytes(content)
        unmet = Unmet(file)
        begun = asyncio.ensure_future(unmet.it.start(unmet.alarms))
        async with asyncio.timeout(PATIENCE_S):
            while not unmet.texts:
                await asyncio.sleep(0.01)
        assert unmet.texts[0].startswith("error: The station's file cannot be used")
        assert "Other stations are neither seen nor told anything" in unmet.it.message().text
        assert (unmet.it.message().station, unmet.it.message().router) == ("", "lost")
        assert (unmet.it.row().state, "cannot be used" in unmet.it.row().text) == ("accept", True)
        # Nor where a node that a server before this one has left still hears everybody.
        unmet.now_s = NOW_S
        unmet.it.on_status(GOOD)
        assert (unmet.it.row().state, "cannot be used" in unmet.it.message().text) == ("accept", True)
        assert unmet.started == []
        # As long as that runs, they are seen and told: it is not said that they are not.
        for is_told, now_s in ((True, NOW_S), (False, NOW_S + NODE_SILENT_S + 1.0)):
            unmet.now_s = now_s
            async with asyncio.timeout(PATIENCE_S):
                while ("still runs, as Alpha" in unmet.it.message().text) != is_told:
                    await asyncio.sleep(0.01)
            assert ("neither seen nor told" in unmet.it.message().text) != is_told
            assert ("still runs, as Alpha" in unmet.texts[0]) == is_told
            assert ("neither seen nor told" in unmet.it.row().text) != is_told
        file.unlink(missing_ok=True)
        write_station_files(file.parent, CertificateFiles(tmp_path / "data"), ["Alpha"], ["router"], now_utc())
        await asyncio.wait_for(begun, PATIENCE_S)
        assert unmet.started == [("Alpha", ("tls/router:7447",), file, file.with_name("fetched"))]
        assert (unmet.texts, unmet.it.message().station) == ([], "Alpha")
        assert "cannot be used" not in unmet.it.row().text + unmet.it.message().text

    asyncio.run(whole())
