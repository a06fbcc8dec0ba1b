"""``hedgehop stations``: files for stations and their router, and what is wrong with wrong ones."""

from __future__ import annotations

import json
import os
import stat
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID

from server.door.certificates import CERTIFICATE_LASTS, CertificateFiles, now_utc
from server.door.station_files import ROUTER_FILE, station_of, write_station_files
from server.errors import StartError
from server.settings import load_settings
from telemetry.errors import StationsError
from telemetry.stations.station_names import router_endpoint
from telemetry.stations.station_proof import Route, ends_soon, read_proof, why_refused
from tests.server.cli_runs import hedgehop


@pytest.fixture(autouse=True)
def _own_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))


def router(out: Path) -> dict[str, Any]:
    return json.loads((out / ROUTER_FILE).read_text().partition("\n")[2])


def test_the_command_writes_what_the_stations_and_the_router_need(tmp_path: Path) -> None:
    out = tmp_path / "fleet"
    done = hedgehop("stations", "router.example", "10.0.0.5", "--station", "Alpha", "--station", "Bravo", "--out", out)
    assert done.code == 0, done.err
    assert "stations_router" in done.err
    assert {path.name for path in out.iterdir()} == {"Alpha.pem", "Bravo.pem", ROUTER_FILE}
    assert {stat.S_IMODE(path.stat().st_mode) for path in out.iterdir()} == {0o600}
    assert (station_of(out / "Alpha.pem"), station_of(out / "Bravo.pem")) == ("Alpha", "Bravo")
    before = (out / "Alpha.pem").read_bytes()
    # A third one later: the first two keep theirs, and the router knows all.
    assert hedgehop("stations", "router.example", "--station", "Charlie", "--out", out).code == 0
    assert (out / "Alpha.pem").read_bytes() == before
    control = router(out)["access_control"]
    assert control["default_permission"] == "deny"
    told = {rule["id"]: rule["key_exprs"] for rule in control["rules"] if "put" in rule["messages"]}
    assert told["tell-Bravo"] == ["hedgehop/stations/1/Bravo/**"]
    assert [policy["rules"][-1] for policy in control["policies"]] == ["tell-Alpha", "tell-Bravo", "tell-Charlie"]


def test_a_stations_certificate_shows_no_site(tmp_path: Path) -> None:
    write_station_files(tmp_path, CertificateFiles(tmp_path / "data"), ["Alpha"], ["router.example"], now_utc())
    certificate = x509.load_pem_x509_certificates((tmp_path / "Alpha.pem").read_bytes())[0]
    usage = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    assert list(usage) == [ExtendedKeyUsageOID.CLIENT_AUTH]
    with pytest.raises(x509.ExtensionNotFound):
        certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)


def test_files_that_end_soon_are_made_anew(tmp_path: Path) -> None:
    authority = CertificateFiles(tmp_path / "data")
    write_station_files(tmp_path, authority, ["Alpha"], ["router.example"], now_utc())
    later = now_utc() + CERTIFICATE_LASTS - timedelta(days=20)
    written = write_station_files(tmp_path, authority, [], ["router.example"], later)
    assert (written.kept, [path.name for path in written.made]) == ([], ["Alpha.pem", ROUTER_FILE])


def test_files_of_another_authority_are_made_anew(tmp_path: Path) -> None:
    """They would be refused at the router, whose file trusts the one of this machine alone."""
    out = tmp_path / "fleet"
    write_station_files(out, CertificateFiles(tmp_path / "before"), ["Alpha", "Bravo"], ["router.example"], now_utc())
    before = (out / "Alpha.pem").read_bytes()
    written = write_station_files(out, CertificateFiles(tmp_path / "now"), ["Bravo"], ["router.example"], now_utc())
    assert ([path.name for path in written.made], written.kept) == (["Alpha.pem", "Bravo.pem", ROUTER_FILE], [])
    assert (out / "Alpha.pem").read_bytes() != before
    for name in ("Alpha", "Bravo"):
        proof = read_proof(out / f"{name}.pem")
        assert proof.authority_pem.strip() == (tmp_path / "now" / "tls" / "authority.pem").read_bytes().strip()


@pytest.mark.parametrize(("days", "words"), [(0, "has ended"), (-400, "valid from")])
def test_a_certificate_that_is_not_valid_is_told_before_anybody_is_asked(tmp_path: Path, days: int, words: str) -> None:
    write_station_files(tmp_path, CertificateFiles(tmp_path / "data"), ["Alpha"], ["router.example"], now_utc())
    now = now_utc() + CERTIFICATE_LASTS + timedelta(days=days)
    route = Route(("tls/127.0.0.1:1",), tmp_path / "Alpha.pem")
    assert words in why_refused(route, now)
    assert why_refused(route, now_utc()).startswith("No router answers at 127.0.0.1:1 (")


def test_that_a_certificate_ends_is_told_thirty_days_ahead(tmp_path: Path) -> None:
    write_station_files(tmp_path, CertificateFiles(tmp_path / "data"), ["Alpha"], ["router.example"], now_utc())
    route = Route(("tls/127.0.0.1:1",), tmp_path / "Alpha.pem")
    until_utc = read_proof(route.file).until_utc
    assert ends_soon(route, until_utc - timedelta(days=31)) == ""
    assert f"ends on {until_utc:%Y-%m-%d}" in ends_soon(route, until_utc - timedelta(days=29))
    route.file.write_text("nothing")
    assert "cannot be read" in ends_soon(route, until_utc)
    assert "cannot be read" in why_refused(route, until_utc)


@pytest.mark.parametrize("name", ["", "*", "../up", "a b", "Älpha", "x" * 25])
def test_what_is_no_name_is_refused_before_anything_is_written(tmp_path: Path, name: str) -> None:
    done = hedgehop("stations", "router.example", "--station", name, "--out", tmp_path / "fleet")
    assert done.code == 2
    assert "station's name" in done.err
    assert not list((tmp_path / "fleet").glob("*"))


def test_a_folder_with_other_certificates_is_left_as_it_is(tmp_path: Path) -> None:
    write_station_files(tmp_path / "fleet", CertificateFiles(tmp_path), ["Alpha"], ["router.example"], now_utc())
    done = hedgehop("stations", "router.example", "--station", "Bravo", "--out", tmp_path / "tls")
    assert (done.code, "authority.pem is no file of a station" in done.err) == (2, True)
    assert {path.name for path in (tmp_path / "tls").iterdir()} == {"authority.pem", "authority.key"}


def test_names_that_differ_in_capitals_only_are_refused(tmp_path: Path) -> None:
    done = hedgehop("stations", "router.example", "--station", "Alpha", "--station", "ALPHA", "--out", tmp_path)
    assert done.code == 2
    assert "capitals" in done.err


def test_a_file_that_is_no_stations_stops_the_start_with_words(tmp_path: Path) -> None:
    write_station_files(tmp_path, CertificateFiles(tmp_path / "data"), ["Alpha"], ["router.example"], now_utc())
    whole = (tmp_path / "Alpha.pem").read_text()
    for text in ("", "nothing", whole.split("-----BEGIN CERTIFICATE")[0], whole.replace("MI", "XX")):
        (tmp_path / "odd.pem").write_text(text)
        with pytest.raises(StartError, match="station's file"):
            station_of(tmp_path / "odd.pem")
    with pytest.raises(StartError, match="station's file"):
        station_of(tmp_path / "none.pem")


PARTS = (
    "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n",
    "-----BEGIN CERTIFICATE-----\n{}\n-----END CERTIFICATE-----\n",
)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (PARTS[0] + 2 * PARTS[1].format("AAAA"), "Its certificate is damaged"),
        (PARTS[0] + 2 * PARTS[1].format("!!!"), "Its certificate is damaged"),
        (PARTS[0] + 2 * PARTS[1].format("MIIB"), "Its certificate is damaged"),
        ("ä", "It holds something else than keys and certificates"),
        ("", "It must hold a key, the station's certificate and the authority's"),
    ],
)
def test_what_is_wrong_with_its_file_is_told_in_plain_words(tmp_path: Path, content: str, why: str) -> None:
    (tmp_path / "Alpha.pem").write_text(content)
    with pytest.raises(StartError) as odd:
        station_of(tmp_path / "Alpha.pem")
    assert odd.value.what == f"The station's file cannot be used: {why}."


def test_a_pipe_or_a_folder_in_the_files_place_is_refused_and_nobody_waits_for_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path):
        with pytest.raises(StartError, match="It is not a regular file"):
            station_of(path)
    with pytest.raises(StartError, match="Its name is no path"):
        station_of(Path("/x\0y"))


def test_settings_are_set_both_or_neither(tmp_path: Path) -> None:
    assert load_settings().stations_router == ()
    both = load_settings(stations_router="router.example, 10.0.0.5:7448", stations_file=tmp_path / "Alpha.pem")
    assert both.stations_router == ("tls/router.example:7447", "tls/10.0.0.5:7448")
    with pytest.raises(StartError, match="belong together"):
        load_settings(stations_router=["router.example"])
    with pytest.raises(StartError, match="belong together"):
        load_settings(stations_file=tmp_path / "Alpha.pem")
    with pytest.raises(StartError, match="is no router"):
        load_settings(stations_router=["tcp/10.0.0.5:7447"], stations_file=tmp_path / "Alpha.pem")


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("router.example", "tls/router.example:7447"),
        ("tls/10.0.0.5:7448", "tls/10.0.0.5:7448"),
        ("[fd00::5]", "tls/[fd00::5]:7447"),
        ("[fd00::5]:99", "tls/[fd00::5]:99"),
    ],
)
def test_routers(text: str, endpoint: str) -> None:
    assert router_endpoint(text) == endpoint


@pytest.mark.parametrize("text", ["", "a:0", "a:65536", "a:x", "a b", "udp/a:1", "tls/", "fd00::5", "a#b", "a:²"])
def test_what_is_no_router(text: str) -> None:
    with pytest.raises(StationsError, match="is no router"):
        router_endpoint(text)
