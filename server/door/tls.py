"""How browsers reach the station beyond this machine: by TLS, by a proxy that adds it, or not at all."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import socket
import ssl
from pathlib import Path

from planning.errors import DescribedError
from server.door.alarms import Alarms
from server.door.certificates import CertificateFiles, Names, now_utc, read_certificate
from server.door.trust import TrustOffer
from server.errors import CertificateError, StartError, reported
from server.settings import Settings

log = logging.getLogger("hedgehop.tls")

LOOK_EVERY_S = 30.0
# What TLS 1.2 may use; TLS 1.3 has none that are weak. All of them keep what was recorded secret for ever.
_CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"


class Tls:
    """The console's certificate, held by a context that takes up a new one while it serves."""

    def __init__(self, chain: Path, key: Path | None, *, own: CertificateFiles | None) -> None:
        self._chain, self._key, self.own = chain, key, own
        """``own``: made here, and renewed here."""
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self.context.minimum_version = ssl.TLSVersion.TLSv1_2
        self.context.set_ciphers(_CIPHERS)
        self.context.set_alpn_protocols(["http/1.1"])
        self._loaded_ns, self._told = 0, ""
        self.names = Names(frozenset(), frozenset())
        self._load()

    @classmethod
    def of(cls, settings: Settings) -> Tls | None:
        """None: in plain text. Raises StartError where that would cross the network, CertificateError, StorageError."""
        if settings.behind_proxy or is_loopback(settings.host):
            return None
        if settings.tls_certificate is not None:
            return cls(settings.tls_certificate, settings.tls_key, own=None)
        files = CertificateFiles(settings.data_dir)
        if not files.exist():
            raise StartError(
                f"On {settings.host} Hedgehop would speak plain HTTP: whoever listens in that network takes over the "
                "sign-in, and with it the vehicle.",
                where="setting host",
                advice="Run hedgehop tls once and start again. If a proxy here adds TLS, say --behind-proxy.",
            )
        try:
            files.renew(now_utc())
        except DescribedError as error:
            # The old one may do: better than no station.
            log.warning("The certificate could not be renewed: %s", error)
        return cls(files.server, None, own=files)

    async def run(self, alarms: Alarms) -> None:
        """Until cancelled: renews an own certificate, takes up whatever is new."""
        while True:
            await asyncio.sleep(LOOK_EVERY_S)
            try:
                if self.own is not None and await asyncio.to_thread(self.own.renew, now_utc()):
                    log.info("The certificate was made anew.")
                # Here, on the loop, where connections are accepted: a context is not for two threads at once.
                self._load()
                self._told = ""
                alarms.end("certificate")
            except Exception as error:
                doc = reported(error, log, "Renewing the certificate")
                if doc.what != self._told:
                    self._told = doc.what
                    log.error("The certificate could not be renewed: %s (%s)", doc.what, doc.where)
                    what = f"The console's certificate could not be renewed. {doc.what}"
                    alarms.begin("certificate", doc.model_copy(update={"what": what}))

    def reachable(self, host: str) -> str:
        """A name or address of the certificate under which this machine is found: for links that others open."""
        if host not in ("0.0.0.0", "::"):
            return f"[{host}]" if ":" in host else host
        outside = [a for a in self.names.addresses if not a.is_loopback]
        ours = _address_of_network()
        for address in sorted(outside, key=lambda a: (a != ours, a.version, a.packed)):
            return f"[{address}]" if address.version == 6 else str(address)
        return next(iter(sorted(self.names.dns - {"localhost"})), "localhost")

    def offer(self, settings: Settings) -> TrustOffer | None:
        """Of an authority of our own: how other devices come to trust it."""
        if self.own is None or not settings.trust_port:
            return None
        name = self.reachable(settings.host)
        return TrustOffer(self.own, f"https://{name}:{settings.port}/", f"http://{name}:{settings.trust_port}/")

    def _load(self) -> None:
        try:
            changed_ns = max(path.stat().st_mtime_ns for path in (self._chain, self._key) if path)
            if changed_ns == self._loaded_ns:
                return
            self.names = read_certificate(self._chain).names
            self.context.load_cert_chain(self._chain, self._key, _no_passphrase)
        except (OSError, ssl.SSLError) as error:
            raise CertificateError(
                f"The certificate cannot be used: {error.strerror or error}.",
                where=str(self._chain),
                advice="Correct tls_certificate and tls_key, or run hedgehop tls.",
            ) from error
        self._loaded_ns = changed_ns


def _address_of_network() -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Ours in the network that leads elsewhere, which a container's bridge does not. Nothing is sent for it."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.connect(("198.51.100.1", 9))  # set aside for documents: nobody has it
        return ipaddress.ip_address(asking.getsockname()[0])
    return None


def is_loopback(host: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return host == "localhost"


def _no_passphrase() -> str:
    raise ssl.SSLError(0, "its key is locked by a passphrase, which nobody could type at a restart")
