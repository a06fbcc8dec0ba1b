"""``hedgehop upload`` to a vehicle that obeys nobody without its key."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from planning.formats.wpl import write_wpl
from server.library.directory_lock import locked
from telemetry.link.audit import AUDIT_FILE
from telemetry.link.keys import signing_key_file
from telemetry.link.signatures import KeyRing
from telemetry.topics.requests import Connect, SetSigning
from tests.server.cli_runs import Run, hedgehop
from tests.server.flight_logs import mission
from tests.server.simulated import simulated_vehicle
from tests.telemetry.link_bench import ME, console

pytestmark = pytest.mark.xdist_group("cli-flying")
FLIGHT = mission([(50.0, 150.0, 12.0), (90.0, 150.0, 12.0)])
HOME = f"{FLIGHT.home.lat_deg:.7f},{FLIGHT.home.lon_deg:.7f},100"


async def set_up(link: str, data: Path) -> None:
    async with console(keys=KeyRing(signing_key_file(data))) as bench:
        await bench.handle(Connect(ME, link, True))
        await bench.live()
        await bench.handle(SetSigning(ME, True))


def test_with_the_keys_of_its_data_directory_it_is_obeyed_and_without_it_is_not(tmp_path: Path) -> None:
    flight, data = tmp_path / "flight.waypoints", tmp_path / "data"
    flight.write_text(write_wpl(FLIGHT))
    data.mkdir()

    def upload(link: str, *options: object) -> Run:
        return hedgehop("upload", flight, "--link", link, "--json", *options)

    with simulated_vehicle(HOME, "--boot-s", 1) as link:
        asyncio.run(set_up(link, data))
        for _ in range(2):  # the second does not repeat what the first has signed
            signed = upload(link, "--data-dir", data)
            assert signed.code == 0, signed.err
            assert signed.json["verified"] is True
        assert hedgehop("audit", data).code == 0
        logged = [json.loads(line) for line in (data / AUDIT_FILE).read_text().splitlines()]
        assert {entry.get("operator") for entry in logged} == {"command line"}
        with locked(data):
            in_use = upload(link, "--data-dir", data)
        assert (in_use.code, in_use.json["error"]["code"]) == (2, "data_dir")
        missing = upload(link, "--data-dir", tmp_path / "nothing")
        assert missing.code == 2
        assert "no such data directory" in missing.err
        unsigned = upload(link)
        assert unsigned.code != 0
        assert "a key that is not here: it will not obey" in unsigned.err
