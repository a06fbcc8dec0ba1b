"""The laptop's own certificate authority, and the certificate of its console.

``tls/`` in the data directory holds ``authority.pem`` (which tablets are to trust), ``authority.key``, ``console.pem``
(the console's key and certificates in one file, so that both are replaced at once) and ``names.txt`` (what else than
the machine's own names and addresses the certificate is for). All are readable by their user only.
"""

from __future__ import annotations

import hashlib
import ipaddress
import socket
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from server.errors import CertificateError
from server.library.whole_files import storage_errors, write_atomically

if TYPE_CHECKING:
    # Loading it takes a tenth of a second, and only who makes certificates needs it.
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

FOLDER = "tls"
AUTHORITY_LASTS = timedelta(days=3650)
CERTIFICATE_LASTS = timedelta(days=397)
"""Longer ones are refused by some browsers."""
RENEWED_BEFORE = timedelta(days=30)
_CLOCKS_DIFFER_BY = timedelta(days=2)

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


@dataclass(frozen=True, slots=True)
class Names:
    """What a certificate is for."""

    dns: frozenset[str]
    addresses: frozenset[Address]

    def holds(self, other: Names) -> bool:
        return other.dns <= self.dns and other.addresses <= self.addresses

    def with_given(self, names: list[str]) -> Names:
        """And these names or addresses; raises CertificateError for what is neither."""
        dns, addresses = set(self.dns), set(self.addresses)
        for name in names:
            try:
                addresses.add(ipaddress.ip_address(name))
            except ValueError:
                dns.add(_checked(name))
        return Names(frozenset(dns), frozenset(addresses))


@dataclass(frozen=True, slots=True)
class Certificate:
    """What is to be known of the console's certificate."""

    names: Names
    since_utc: datetime
    until_utc: datetime

    def is_due(self, wanted: Names, now_utc: datetime) -> bool:
        """Whether it has to be made anew; addresses that are gone for now may come back."""
        return self.ends_soon(now_utc) or not self.names.holds(wanted)

    def ends_soon(self, now_utc: datetime) -> bool:
        return not self.since_utc <= now_utc < self.until_utc - RENEWED_BEFORE


class CertificateFiles:
    """Blocking calls, for threads."""

    def __init__(self, data_dir: Path) -> None:
        folder = data_dir.expanduser().absolute() / FOLDER
        self.folder = folder
        self.authority, self.server = folder / "authority.pem", folder / "console.pem"
        self._authority_key, self._names = folder / "authority.key", folder / "names.txt"

    def exist(self) -> bool:
        return self.server.is_file()

    def add_names(self, names: list[str]) -> None:
        """For this certificate and all that follow. Raises CertificateError, StorageError."""
        known = self._given_names()
        Names(frozenset(), frozenset()).with_given(names)
        self._make_folder()
        write_atomically(self._names, "".join(f"{name}\n" for name in sorted({*known, *names})).encode())

    def renew(self, now_utc: datetime, machine: Names | None = None) -> bool:
        """Makes what is missing, ends soon or lacks a name. Whether anything was made; raises CertificateError."""
        wanted = (machine or names_of_machine()).with_given(self._given_names())
        if self.exist() and not self.certificate().is_due(wanted, now_utc):
            return False
        authority = self._authority_now(now_utc)
        write_atomically(self.server, b"".join(_new_certificate(wanted, self._load_key(), authority, now_utc)))
        return True

    def issue(self, common_name: str, now_utc: datetime, names: Names | None = None) -> tuple[bytes, bytes]:
        """Key, and certificate with the authority's, as PEM: of a server under ``names``, else of a client.

        Makes the authority if there is none. Raises CertificateError, StorageError.
        """
        authority = self._authority_now(now_utc)
        return _new_certificate(names, self._load_key(), authority, now_utc, common_name)

    def _authority_now(self, now_utc: datetime) -> x509.Certificate:
        """Made if there is none. Raises CertificateError when it has ended, or ends soon."""
        if not self._authority_key.is_file():
            self._make_folder()
            key, made = _new_authority(now_utc)
            write_atomically(self._authority_key, _key_pem(key))
            write_atomically(self.authority, _pem(made))
        authority = self._load_authority()
        if not authority.not_valid_before_utc <= now_utc < authority.not_valid_after_utc - RENEWED_BEFORE:
            raise CertificateError(
                f"This machine's certificate authority is valid from {authority.not_valid_before_utc:%Y-%m-%d} to "
                f"{authority.not_valid_after_utc:%Y-%m-%d}, and its clock says {now_utc:%Y-%m-%d}.",
                where=str(self.authority),
                advice=f"Set the clock; or remove {self.folder}, run hedgehop tls, and let all devices trust it anew.",
            )
        return authority

    def certificate(self) -> Certificate:
        """Raises CertificateError when it cannot be read."""
        return read_certificate(self.server)

    def authority_sha256(self) -> str:
        """As browsers and systems show it: pairs of hexadecimal digits."""
        from cryptography.hazmat.primitives.serialization import Encoding

        digest = hashlib.sha256(self._load_authority().public_bytes(Encoding.DER)).hexdigest().upper()
        return ":".join(digest[at : at + 2] for at in range(0, len(digest), 2))

    def _given_names(self) -> list[str]:
        with storage_errors(self._names):
            return self._names.read_text(encoding="utf-8").split() if self._names.is_file() else []

    def _make_folder(self) -> None:
        with storage_errors(self.folder):
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)

    def _load_authority(self) -> x509.Certificate:
        return _first_certificate(self.authority)

    def _load_key(self) -> EllipticCurvePrivateKey:
        from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key

        try:
            key = load_pem_private_key(self._authority_key.read_bytes(), None)
        except (OSError, ValueError) as error:
            raise _unreadable(self._authority_key, error) from error
        if not isinstance(key, EllipticCurvePrivateKey):
            raise _unreadable(self._authority_key, ValueError("it is no key of ours"))
        return key


def read_certificate(path: Path) -> Certificate:
    """The first one in a PEM file. Raises CertificateError."""
    from cryptography import x509

    certificate = _first_certificate(path)
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        dns = frozenset(names.get_values_for_type(x509.DNSName))
        addresses = frozenset(names.get_values_for_type(x509.IPAddress))
    except x509.ExtensionNotFound:
        dns = addresses = frozenset[str]()
    own = frozenset(address for address in addresses if isinstance(address, Address))
    return Certificate(Names(dns, own), certificate.not_valid_before_utc, certificate.not_valid_after_utc)


def read_common_name(path: Path) -> str:
    """Of the first certificate in a PEM file. Raises CertificateError."""
    from cryptography.x509.oid import NameOID

    found = _first_certificate(path).subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if len(found) == 1 else ""


def names_of_machine() -> Names:
    """Its host name, also as neighbours find it (mDNS), and all addresses that it has now."""
    host = socket.gethostname().lower()
    names = {"localhost", *({host, f"{host.partition('.')[0]}.local"} if _is_dns_name(host) else ())}
    return Names(frozenset(names), frozenset({*_ipv4_addresses(), *_ipv6_addresses()}))


def _ipv4_addresses(table: Path = Path("/proc/net/fib_trie")) -> set[Address]:
    found: set[Address] = {ipaddress.ip_address("127.0.0.1")}
    last = ""
    for line in _lines(table):
        words = line.split()
        if words[:1] in (["|--"], ["+--"]):
            last = words[1]
        elif words == ["/32", "host", "LOCAL"]:
            found.add(ipaddress.ip_address(last))
    return found


def _ipv6_addresses(table: Path = Path("/proc/net/if_inet6")) -> set[Address]:
    """Without those of the link alone: browsers cannot name their interface."""
    addresses = {ipaddress.ip_address(bytes.fromhex(line.split()[0])) for line in _lines(table)}
    return {address for address in addresses if not address.is_link_local}


def _lines(table: Path) -> list[str]:
    try:
        return table.read_text(encoding="ascii").splitlines()
    except OSError:
        return []


def _is_dns_name(name: str) -> bool:
    labels = name.split(".")
    return len(name) <= 253 and all(
        0 < len(label) < 64 and label.isascii() and label.replace("-", "a").isalnum() for label in labels
    )


def _checked(name: str) -> str:
    if not _is_dns_name(name):
        raise CertificateError(
            f"{name!r} is neither a host name nor an address.", advice="Give names such as gcs.local or 192.168.1.20."
        )
    return name.lower()


def _new_authority(now_utc: datetime) -> tuple[EllipticCurvePrivateKey, x509.Certificate]:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import NameOID

    key = ec.generate_private_key(ec.SECP256R1())
    # Tablets list it by this name; the date tells one from the one before.
    title = f"Hedgehop on {socket.gethostname()[:30]}, {now_utc:%Y-%m-%d}"
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, title)])
    usage = x509.KeyUsage(False, False, False, False, False, True, True, False, False)
    authority = (
        x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number())
        .not_valid_before(now_utc - _CLOCKS_DIFFER_BY)
        .not_valid_after(now_utc + AUTHORITY_LASTS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return key, authority


def _new_certificate(
    names: Names | None,
    authority_key: EllipticCurvePrivateKey,
    authority: x509.Certificate,
    now_utc: datetime,
    common_name: str = "Hedgehop",
) -> tuple[bytes, bytes]:
    """Its key; itself and the authority, as PEM. Without names it is a client's, and no server can show it."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    key = ec.generate_private_key(ec.SECP256R1())
    usage = x509.KeyUsage(True, False, False, False, False, False, False, False, False)
    above = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority_key.public_key())
    builder = (
        x509.CertificateBuilder(
            authority.subject,
            x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)]),
            key.public_key(),
            x509.random_serial_number(),
        )
        .not_valid_before(now_utc - _CLOCKS_DIFFER_BY)
        .not_valid_after(min(now_utc + CERTIFICATE_LASTS - _CLOCKS_DIFFER_BY, authority.not_valid_after_utc))
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(above, critical=False)
    )
    purpose = ExtendedKeyUsageOID.CLIENT_AUTH
    if names is not None:
        purpose = ExtendedKeyUsageOID.SERVER_AUTH
        alternatives = [x509.DNSName(name) for name in sorted(names.dns)]
        alternatives += [x509.IPAddress(address) for address in sorted(names.addresses, key=str)]
        builder = builder.add_extension(x509.SubjectAlternativeName(alternatives), critical=False)
    builder = builder.add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
    certificate = builder.sign(authority_key, hashes.SHA256())
    return _key_pem(key), _pem(certificate) + _pem(authority)


def _key_pem(key: EllipticCurvePrivateKey) -> bytes:
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _pem(certificate: x509.Certificate) -> bytes:
    from cryptography.hazmat.primitives.serialization import Encoding

    return certificate.public_bytes(Encoding.PEM)


def _first_certificate(path: Path) -> x509.Certificate:
    from cryptography import x509

    try:
        return x509.load_pem_x509_certificates(path.read_bytes())[0]
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> CertificateError:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return CertificateError(
        f"A certificate's file cannot be read: {reason}.",
        where=str(path),
        advice="Restore it; or remove the folder tls, run hedgehop tls, and let all devices trust it anew.",
    )


def now_utc() -> datetime:
    return datetime.now(UTC).replace(microsecond=0)
