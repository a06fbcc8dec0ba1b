"""A whole station that meets another one at a router: its pages see that one's vehicles, and are told of its loss."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest

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
        # Who commands it there is told, and a command for it from here is refused with that.
        assert {vehicle.in_charge for vehicle in seen.stations[0].vehicles} == {"Anna"}
        for path in ("/api/lease/take", "/api/flight/arm", "/api/flight/land"):
            refused = alpha.http.post(path, headers={"Hedgehop-Vehicle": "Bravo/2"})
            assert (refused.status_code, refused.json()["code"]) == (403, "other_station")
            assert refused.json()["what"].startswith("Drone 2 (Bravo 2) is commanded by Bravo alone")
            assert refused.json()["advice"] == "Anna is in charge of it there. Call Bravo."
        elsewhere = alpha.http.post("/api/lease/take", headers={"Hedgehop-Vehicle": "2"})
        assert (elsewhere.status_code, "Bravo/2 is another station's" in elsewhere.json()["advice"]) == (404, True)
        assert alpha.http.post("/api/lease/take", headers={"Hedgehop-Vehicle": "Alpha/1"}).is_success
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


@pytest.mark.xdist_group("real-time")
@pytest.mark.slow
def test_without_its_file_a_station_starts_says_so_and_meets_others_once_it_is_there() -> None:
    async def whole(folder: Path) -> None:
        field = Field(folder, ("Alpha", "Bravo"))
        await field.router.start()
        try:
            async with field.station("Bravo"):
                await asyncio.to_thread(_without_file, folder, field)
        finally:
            field.router.kill()

    with short_folder() as folder:
        run(lambda: whole(folder))


def _without_file(folder: Path, field: Field) -> None:
    file = folder / "Alpha.pem"
    settings: dict[str, Any] = {"stations_router": (f"127.0.0.1:{field.port}",), "stations_file": file}
    with station(folder / "alpha", flies=True, **settings) as alpha:
        told = _stations(alpha, lambda told: "cannot be used" in told.text)
        assert (told.station, told.router, told.stations) == ("", "lost", [])
        with alpha.server.socket() as socket:
            (alarm,) = Station(alpha.server, socket).until(lambda message: message.type == "alarms").alarms
        assert (alarm.kind, alarm.level, str(file) in alarm.error.where) == ("stations", "error", True)
        assert "Own vehicles are not affected" in alarm.error.what
        # Its own vehicle is there as ever.
        assert alpha.http.post("/api/lease/take").is_success
        file.write_bytes((field.files / "Alpha.pem").read_bytes())
        alpha.until(lambda message: message.type == "alarms" and not message.alarms)
        assert _stations(alpha, lambda told: bool(told.stations) and not told.text).station == "Alpha"


def _stations(page: Station, holds: Any) -> Any:
    return page.until(lambda message: message.type == "stations" and holds(message))
