"""TLS from the laptop's own authority: what is made, and when it is made anew."""

from __future__ import annotations

import ipaddress
import stat
from datetime import timedelta
from pathlib import Path

import pytest

from server.app import AnnouncingServer
from server.door import certificates, tls
from server.door.certificates import AUTHORITY_LASTS, CertificateFiles, Names, names_of_machine, now_utc
from server.door.tls import Tls
from server.errors import CertificateError, StartError
from server.settings import Settings

HERE = Names(frozenset({"localhost", "laptop", "laptop.local"}), frozenset({ipaddress.ip_address("127.0.0.1")}))
MOVED = HERE.with_given(["192.168.7.5"])


@pytest.fixture
def files(tmp_path: Path) -> CertificateFiles:
    files = CertificateFiles(tmp_path)
    assert files.renew(now_utc(), HERE)
    return files


def test_keys_are_readable_by_their_user_only(files: CertificateFiles) -> None:
    assert stat.S_IMODE(files.folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in files.folder.iterdir()} == {0o600}
    assert files.certificate().names == HERE


def test_the_link_leads_to_the_address_in_use_not_to_a_bridge(
    files: CertificateFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = HERE.with_given(["172.17.0.1", "192.168.7.5"])
    assert files.renew(now_utc(), names)
    station = Tls(files.server, None, own=files)
    monkeypatch.setattr(tls, "_address_of_network", lambda: ipaddress.ip_address("192.168.7.5"))
    assert station.reachable("0.0.0.0") == "192.168.7.5"
    monkeypatch.setattr(tls, "_address_of_network", lambda: None)
    assert station.reachable("0.0.0.0") == "172.17.0.1"


def test_it_is_made_anew_for_a_new_address_and_before_it_ends_and_the_authority_stays(files: CertificateFiles) -> None:
    authority, now = files.authority.read_bytes(), now_utc()
    assert not files.renew(now, HERE)
    assert files.renew(now, MOVED)
    assert not files.renew(now, HERE)
    until = files.certificate().until_utc
    assert not files.renew(until - timedelta(days=31), MOVED)
    assert files.renew(until - timedelta(days=29), MOVED)
    assert files.certificate().until_utc > until
    assert files.authority.read_bytes() == authority
    assert until - now < timedelta(days=398)


def test_a_clock_that_was_reset_makes_it_anew_and_one_out_of_range_is_said(files: CertificateFiles) -> None:
    for wrong in (now_utc() - timedelta(days=4000), now_utc() + AUTHORITY_LASTS):
        with pytest.raises(CertificateError, match="clock"):
            files.renew(wrong, HERE)


def test_given_names_are_kept_for_all_that_follow(files: CertificateFiles) -> None:
    files.add_names(["GCS.example", "203.0.113.9"])
    assert files.renew(now_utc(), HERE)
    assert files.certificate().names == HERE.with_given(["gcs.example", "203.0.113.9"])
    assert not files.renew(now_utc(), HERE)
    with pytest.raises(CertificateError, match="neither a host name nor an address"):
        files.add_names(["no name"])


@pytest.mark.parametrize("broken", ["console.pem", "authority.pem", "authority.key"])
def test_a_damaged_file_is_named(files: CertificateFiles, broken: str) -> None:
    (files.folder / broken).write_text("-----BEGIN NOTHING-----")
    with pytest.raises(CertificateError, match="cannot be read") as caught:
        files.renew(now_utc(), MOVED)
    assert caught.value.where == str(files.folder / broken)


def test_this_machines_addresses_are_found(tmp_path: Path) -> None:
    table = "Main:\n  +-- 0.0.0.0/0 3 0 5\n     |-- 10.1.2.0\n        /24 link UNICAST\n"
    (tmp_path / "v4").write_text(f"{table}     |-- 10.1.2.3\n        /32 host LOCAL\n")
    (tmp_path / "v6").write_text("fd00" + "0" * 27 + "2 04 40 00 82 eth0\nfe80" + "0" * 27 + "1 04 40 20 80 eth0\n")
    assert set(map(str, certificates._ipv4_addresses(tmp_path / "v4"))) == {"127.0.0.1", "10.1.2.3"}
    assert set(map(str, certificates._ipv6_addresses(tmp_path / "v6"))) == {"fd00::2"}
    assert {"127.0.0.1"} <= set(map(str, names_of_machine().addresses))


def test_plain_text_does_not_leave_the_machine_unasked(tmp_path: Path) -> None:
    with pytest.raises(StartError, match=r"plain HTTP.*hedgehop tls") as caught:
        Tls.of(Settings(data_dir=tmp_path, host="0.0.0.0"))
    assert "--behind-proxy" in caught.value.advice
    assert Tls.of(Settings(data_dir=tmp_path, host="0.0.0.0", behind_proxy=True)) is None
    assert Tls.of(Settings(data_dir=tmp_path, host="127.0.0.2")) is None
    assert Tls.of(Settings(data_dir=tmp_path, host="localhost")) is None


def test_a_certificate_of_ones_own_is_used_and_a_wrong_key_is_said(files: CertificateFiles, tmp_path: Path) -> None:
    own = Settings(data_dir=tmp_path / "other", host="0.0.0.0", tls_certificate=files.server)
    tls = Tls.of(own)
    assert tls is not None
    assert tls.names == HERE
    assert tls.offer(own) is None
    wrong = own.model_copy(update={"tls_key": files.folder / "authority.key"})
    with pytest.raises(CertificateError, match="cannot be used"):
        Tls.of(wrong)


@pytest.mark.parametrize(("host", "printed"), [("0.0.0.0", "192.168.7.5"), ("192.168.7.5", "192.168.7.5")])
def test_the_printed_address_is_one_that_the_certificate_holds(
    files: CertificateFiles, tmp_path: Path, host: str, printed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "names_of_machine", lambda: MOVED)
    settings = Settings(data_dir=tmp_path, host=host)
    tls = Tls.of(settings)
    assert AnnouncingServer(None, settings, tls).origin() == f"https://{printed}:8000"  # pyright: ignore[reportArgumentType]
