"""A whole station that meets another one at a router: its pages see that one's vehicles, and are told of its loss."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

from server.errors import StartError
from server.fleet import Fleet
from server.settings import Settings
from tests.server.station import Station, station
from tests.telemetry.bus_runs import run, short_folder
from tests.telemetry.station_fleet import Field, FieldStation


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_pages_see_the_vehicles_of_another_station_and_its_loss() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, ("Alpha", "Bravo"))
        await field.router.start()
        try:
            async with field.station("Bravo") as bravo:
                await asyncio.to_thread(_look, folder, field, bravo, asyncio.get_running_loop())
        finally:
            field.router.kill()

    with short_folder() as folder:
        run(lambda: whole(folder))


def _look(folder: Path, field: Field, bravo: FieldStation, loop: asyncio.AbstractEventLoop) -> None:
    settings: dict[str, Any] = {
        "stations_router": (f"127.0.0.1:{field.port}",),
        "stations_file": field.files / "Alpha.pem",
    }
    with station(folder / "alpha", flies=True, **settings) as alpha:
        seen = _stations(
            alpha,
            lambda told: (
                told.router == "connected"
                and not told.text
                and [v.age_s is not None for s in told.stations for v in s.vehicles] == [True] * 2
            ),
        )
        assert (seen.station, seen.refused) == ("Alpha", 0)
        assert [vehicle.name for vehicle in seen.stations[0].vehicles] == ["Drone 1", "Drone 2"]
        assert all(vehicle.in_air and not vehicle.text for vehicle in seen.stations[0].vehicles)
        # And the other way round: a vehicle that is not connected is told as such.
        told = bravo.until(lambda status: any(other.station == "Alpha" for other in status.vehicles))
        (own,) = asyncio.run_coroutine_threadsafe(told, loop).result().vehicles
        assert (own.it.name, own.it.link, own.it.lat_deg) == ("Vehicle 1", "none", None)
        # A page that opens later has it at once.
        with alpha.server.socket() as socket:
            assert _stations(Station(alpha.server, socket), lambda told: bool(told.stations)).station == "Alpha"
        # The router dies: said, and this station goes on.
        field.router.kill()
        # On a busy machine the node may be silent for a moment: that is told, too, in other words.
        _stations(alpha, lambda told: bool(told.stations) and "is not heard since" in told.stations[0].text)
        _stations(alpha, lambda told: told.router == "lost" and f"127.0.0.1:{field.port}" in told.text)
        assert alpha.http.get("/api/state").is_success
        assert alpha.until(lambda message: message.type == "fleet").vehicles[0].number == 1


def _stations(page: Station, holds: Any) -> Any:
    return page.until(lambda message: message.type == "stations" and holds(message))


def test_a_station_whose_file_is_none_does_not_start(tmp_path: Path) -> None:
    (tmp_path / "odd.pem").write_text("nothing")
    settings: dict[str, Any] = {"stations_router": ("router.example",), "stations_file": tmp_path / "odd.pem"}
    with pytest.raises(StartError, match="station's file cannot be used"):
        asyncio.run(_opened(tmp_path, settings))


async def _opened(tmp_path: Path, settings: dict[str, Any]) -> None:
    none: Any = None
    await Fleet.open(Settings(data_dir=tmp_path, **settings), none, none, none, none, False)
