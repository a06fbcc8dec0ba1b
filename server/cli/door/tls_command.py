"""``hedgehop tls``: a certificate for this machine, and how other devices come to trust it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from server.cli.shared.command import command
from server.cli.shared.output import say
from server.door.certificates import CertificateFiles, now_utc
from server.settings import load_settings


@command
def tls(
    *,
    name: Annotated[
        list[str] | None,
        Option(
            metavar="NAME",
            help="A further name or address under which this machine is reached; may be given several times.",
        ),
    ] = None,
    data_dir: Annotated[
        Path | None, Option(help="Where models and plans are kept; default: the user's data home.")
    ] = None,
) -> None:
    """Make or renew the certificate with which other devices reach this station, and say how they trust it."""
    settings = load_settings(data_dir=data_dir)
    files = CertificateFiles(settings.data_dir)
    if name:
        files.add_names(name)
    made = files.renew(now_utc())
    certificate = files.certificate()
    names = [*sorted(certificate.names.dns), *sorted(map(str, certificate.names.addresses))]
    say(
        f"{'Made' if made else 'Kept'}: {files.server}, for {', '.join(names)}, until {certificate.until_utc:%Y-%m-%d}."
    )
    say("The server renews it by itself, also when this machine's addresses change.")
    say(f"The authority that other devices are to trust, once: {files.authority}")
    say(f"Its SHA-256 fingerprint: {files.authority_sha256()}")
    say("Its key, authority.key beside it, stays on this machine: who has it can pretend to be any site to them.")
    say("Now start: hedgehop serve --host 0.0.0.0")
