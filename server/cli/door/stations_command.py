"""``hedgehop stations``: the files with which several stations see each other's vehicles through a router."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from server.cli.shared.command import command
from server.cli.shared.output import say
from server.door.certificates import CertificateFiles, now_utc
from server.door.station_files import ROUTER_FILE, write_station_files
from server.settings import load_settings
from telemetry.stations.station_names import ROUTER_PORT


@command
def stations(
    host: Annotated[
        list[str],
        Argument(
            metavar="HOST", help="A name or address under which the stations meet the router; several if need be."
        ),
    ],
    *,
    station: Annotated[
        list[str], Option(metavar="NAME", help="A station that may take part; may be given several times.")
    ],
    out: Annotated[Path, Option(help="The folder for the files; those of earlier stations in it are kept.")],
    data_dir: Annotated[
        Path | None, Option(help="Where this machine's authority is kept; default: the user's data home.")
    ] = None,
) -> None:
    """Make a file for each station and one for the router, so that stations see each other's vehicles."""
    authority = CertificateFiles(load_settings(data_dir=data_dir).data_dir)
    written = write_station_files(out, authority, station, host, now_utc())
    for path in written.made:
        say(f"Made: {path}")
    for path in written.kept:
        say(f"Kept: {path}")
    say(f"Start the router on {host[0]}: zenohd --config {ROUTER_FILE}  (port {ROUTER_PORT}, TCP)")
    say(f'Bring each station its own file, and set there: stations_router = ["{host[0]}"], stations_file = "..."')
    say("Each of these files holds a private key: whoever has a station's file can speak in its name.")
