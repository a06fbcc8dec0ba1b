"""The console in a browser that trusts the laptop's authority, at the machine's own address: all of it rides on TLS."""

from __future__ import annotations

import base64
import hashlib
import ssl
import time

import pytest
from playwright.sync_api import WebSocket, expect, sync_playwright

from tests.e2e.conftest import FLAGS
from tests.e2e.steps import PATIENCE_MS
from tests.server.test_tls_served import Secure, station

pytestmark = [pytest.mark.e2e, pytest.mark.usefixtures("console")]
secure = station
"""The station of the other tests of TLS, for this module."""


def key_digest(pem: str) -> str:
    """By which Chromium is told to trust a key."""
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

    key = x509.load_pem_x509_certificate(pem.encode()).public_key()
    der = key.public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    return base64.b64encode(hashlib.sha256(der).digest()).decode()


def test_console_stream_and_view_come_by_tls(secure: Secure, chromium_path: str) -> None:
    host, _, port = secure.origin.removeprefix("https://").rpartition(":")
    pem = ssl.get_server_certificate((host.strip("[]"), int(port)), ca_certs=str(secure.files.authority))
    trusted = f"--ignore-certificate-errors-spki-list={key_digest(pem)}"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path, args=[*FLAGS, trusted])
        try:
            page = browser.new_page()
            page.set_default_timeout(PATIENCE_MS)
            sockets: list[str] = []
            faults: list[str] = []

            def opened(socket: WebSocket) -> None:
                sockets.append(socket.url)
                socket.on("socketerror", lambda fault: faults.append(fault))

            page.on("websocket", opened)
            page.goto(secure.link)
            expect(page).to_have_url(f"{secure.origin}/#plan")
            # The 3D view opens its socket in a worker, which tests do not see: test_tls_served.py opens it.
            expect(page.locator("iframe").first).to_be_visible()
            stream, ends = f"wss://{host}:{port}/ws", time.monotonic() + PATIENCE_MS / 1000
            while not any(url.startswith(stream) for url in sockets):
                assert time.monotonic() < ends, f"no {stream} among {sockets}"
                page.wait_for_timeout(100)
            assert all(url.startswith("wss://") for url in sockets)
            assert [cookie.get("secure") for cookie in page.context.cookies()] == [True]
            assert not faults
            assert page.evaluate("isSecureContext")
        finally:
            browser.close()
