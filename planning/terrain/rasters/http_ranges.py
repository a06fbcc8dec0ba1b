"""A surface model on a server of the crew's own, read by HTTP ranges; nothing but what is allowed is ever asked.

The decoding process has no network: it asks this process for bytes, and this process asks one address, which stands
below a prefix that the operator of the machine allowed. Redirects are not followed, no proxy is used.
"""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import re
import socket
import threading
from collections import OrderedDict
from collections.abc import Sequence
from urllib.parse import SplitResult, urlsplit

from planning.errors import ParameterError, RasterError, RasterFormatError, RasterTooLargeError

TIMEOUT_S = 10.0
"""To connect, and for each piece of an answer."""
REQUEST_S = 60.0
"""For a whole answer, of 8 MiB at most: a server that drips is given up."""
WEAK_WORDS = (
    "The server tells no strong ETag, only when the file was written (Last-Modified): "
    "a change within the same second that keeps its size is not noticed."
)
_BLOCK_BYTES = 2**18
_KEPT_BLOCKS = 256
_MOST_BLOCKS = 32
"""Of one request."""
_MOST_BYTES = 2**26
_MOST_FILE_BYTES = 2**43
_TRIES = 2
"""A connection that was kept open may have been closed by the server meanwhile."""
_PORTS = {"http": 80, "https": 443}
_PLAIN_PATH = re.compile(r"/[A-Za-z0-9._~!$&'()*+,;=:@/-]*")


def is_address(source: object) -> bool:
    """Whether something given as a file is an address; a path of one lost a slash."""
    return re.match(r"https?:/", str(source), re.IGNORECASE) is not None


class RemoteFile:
    """One file on a server. Raises RasterError, in words, for whatever keeps it from being read."""

    def __init__(
        self, address: str, allowed: Sequence[str], *, timeout_s: float = TIMEOUT_S, request_s: float = REQUEST_S
    ) -> None:
        whole = re.sub(r"^(https?):/+", r"\1://", address, flags=re.IGNORECASE)
        self._parts = _checked(whole, what="address")
        if not any(_is_below(self._parts, _checked(prefix, what="allowed prefix")) for prefix in allowed):
            raise ParameterError(
                f"{whole} is not below an address that surface models may be read from.",
                where="dsm_urls",
                advice=f"The operator of this machine allows it in the settings: "
                f'dsm_urls = ["{self._parts.scheme}://{self._parts.netloc}/"]',
            )
        self.name = self._parts.path.rpartition("/")[2] or self._parts.netloc
        self._timeout_s, self._request_s = timeout_s, request_s
        self._late = False
        self._lock = threading.Lock()
        self._stopped: threading.Event | None = None
        self._connection: http.client.HTTPConnection | None = None
        self._blocks: OrderedDict[int, bytes] = OrderedDict()
        self._version = ""
        self.is_strong = False
        """Whether every change is noticed: the server tells a strong ETag."""
        self.size_bytes = 0
        try:
            self._look()
        except RasterError:
            self.close()
            raise

    @property
    def sha256(self) -> str:
        """Of address, size and the version that the server tells: the content is never read as a whole."""
        return hashlib.sha256(f"{self._parts.geturl()}\n{self.size_bytes}\n{self._version}".encode()).hexdigest()

    @property
    def identified_by(self) -> str:
        """What its SHA-256 is of, in words."""
        version = "ETag" if self.is_strong else "Last-Modified, to the second"
        return f"address, size and version ({version}); the content was not read as a whole"

    def read(self, offset: int, count: int, *, stopped: threading.Event | None = None) -> bytes:
        """At most ``count`` bytes from ``offset`` on, fewer at the end of the file; an error once ``stopped``."""
        end = min(offset + min(count, _MOST_BYTES), self.size_bytes)
        if not 0 <= offset < end:
            return b""
        with self._lock:
            self._stopped = stopped
            first, last = offset // _BLOCK_BYTES, (end - 1) // _BLOCK_BYTES
            data = b"".join(self._block(number, last) for number in range(first, last + 1))
        return data[offset - first * _BLOCK_BYTES : end - first * _BLOCK_BYTES]

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def abort(self) -> None:
        """Ends, from another thread, the request that is under way."""
        connection = self._connection
        if connection is not None and (sock := connection.sock) is not None:
            with contextlib.suppress(OSError):
                # The plain one: that of TLS would take the state from under its reader.
                socket.socket.shutdown(sock, socket.SHUT_RDWR)

    def _block(self, number: int, last: int) -> bytes:
        """A block, read with those after it that will be needed and are not here."""
        if number not in self._blocks:
            stop = number + 1
            while stop <= last and stop not in self._blocks and stop - number < _MOST_BLOCKS:
                stop += 1
            begin, end = number * _BLOCK_BYTES, min(stop * _BLOCK_BYTES, self.size_bytes)
            data = self._get(begin, end)
            for k in range(number, stop):
                at = k * _BLOCK_BYTES - begin
                self._blocks[k] = data[at : at + _BLOCK_BYTES]
        self._blocks.move_to_end(number)
        found = self._blocks[number]
        while len(self._blocks) > _KEPT_BLOCKS:
            self._blocks.popitem(last=False)
        return found

    def _look(self) -> None:
        """Size and version, from the first bytes."""
        with self._lock:
            answer, _ = self._asked(0, 1)
            found = re.fullmatch(r"bytes 0-0/(\d+)", answer.getheader("Content-Range", ""))
            self._version, self.is_strong = _version(answer), _strong(answer) != ""
        if answer.status != http.client.PARTIAL_CONTENT or found is None:
            raise self._fault("does not answer with parts of a file (HTTP ranges)", "Serve it by a server that does.")
        if not self._version:
            raise self._fault(
                "tells neither a strong ETag nor Last-Modified: nobody would notice that the file was changed",
                "Serve it by a server that does.",
            )
        self.size_bytes = int(found[1])
        if not 0 < self.size_bytes <= _MOST_FILE_BYTES:
            raise RasterTooLargeError(f"The server says that it has {self.size_bytes:,} bytes.", where=self.name)

    def _get(self, begin: int, end: int) -> bytes:
        answer, data = self._asked(begin, end)
        meant = f"bytes {begin}-{end - 1}/{self.size_bytes}"
        if _version(answer) != self._version or answer.status != http.client.PARTIAL_CONTENT:
            raise self._fault("has another version of it now", "Start again.")
        if answer.getheader("Content-Range", "") != meant or len(data) != end - begin:
            raise self._fault("answered with other bytes than were asked for", "Check the server.")
        return data

    def _asked(self, begin: int, end: int) -> tuple[http.client.HTTPResponse, bytes]:
        for tried in range(_TRIES):
            try:
                return self._request(begin, end)
            except (http.client.HTTPException, OSError) as error:
                self.close()
                if tried + 1 == _TRIES or self._late or self._is_stopped or isinstance(error, TimeoutError):
                    raise self._fault(
                        f"cannot be read from ({self._why(error)})", "Check server and network, try again."
                    ) from error
        raise AssertionError("every try returns or raises")

    @property
    def _is_stopped(self) -> bool:
        return self._stopped is not None and self._stopped.is_set()

    def _why(self, error: Exception) -> str:
        if self._is_stopped:
            return "it was stopped"
        if self._late:
            return f"too slow: {self._request_s:g} s were not enough for one answer"
        if isinstance(error, TimeoutError):
            return f"nothing for {self._timeout_s:g} s"
        return str(error) or type(error).__name__

    def _request(self, begin: int, end: int) -> tuple[http.client.HTTPResponse, bytes]:
        """One request within its time: each piece of an answer alone may come in time for ever."""
        self._late = False
        clock = threading.Timer(self._request_s, self._expire)
        clock.daemon = True
        clock.start()
        try:
            answer, data = self._answered(begin, end)
        finally:
            clock.cancel()
            clock.join()
        if self._late or self._is_stopped:  # what came is cut short
            self.close()
            raise ConnectionAbortedError
        return answer, data

    def _expire(self) -> None:
        self._late = True
        self.abort()

    def _answered(self, begin: int, end: int) -> tuple[http.client.HTTPResponse, bytes]:
        if self._connection is None:
            kind = http.client.HTTPSConnection if self._parts.scheme == "https" else http.client.HTTPConnection
            self._connection = kind(self._parts.hostname or "", _port(self._parts), timeout=self._timeout_s)
        headers = {"Range": f"bytes={begin}-{end - 1}", "Accept-Encoding": "identity"}
        if self._connection.sock is None:
            self._connection.connect()
        if self._late or self._is_stopped:  # it came before there was a connection to end
            raise ConnectionAbortedError
        self._connection.request("GET", self._parts.path, headers=headers)
        answer = self._connection.getresponse()
        if answer.status in (http.client.OK, http.client.PARTIAL_CONTENT):
            data = answer.read(end - begin) if answer.status == http.client.PARTIAL_CONTENT else b""
            if not answer.isclosed():  # more than was asked for: the rest is not waited for
                self.close()
            return answer, data
        self.close()
        if 300 <= answer.status < 400:
            raise self._fault("leads elsewhere, which is not followed", "Give the address where the file itself is.")
        raise self._fault(f"answers {answer.status} {answer.reason}", "Check the address.")

    def _fault(self, what: str, advice: str) -> RasterError:
        return RasterError(f"The server {self._parts.netloc} {what}.", where=self.name, advice=advice)


class Look:
    """The reads of one look into a file, which another thread may stop."""

    def __init__(self, file: RemoteFile) -> None:
        self._file, self._stopped = file, threading.Event()

    def read(self, offset: int, count: int) -> bytes:
        return self._file.read(offset, count, stopped=self._stopped)

    def stop(self) -> None:
        """Ends the read that is under way; no other begins."""
        self._stopped.set()
        self._file.abort()


def _version(answer: http.client.HTTPResponse) -> str:
    return _strong(answer) or answer.getheader("Last-Modified") or ""


def _strong(answer: http.client.HTTPResponse) -> str:
    """The ETag, unless it is weak: such a one may stay while bytes change."""
    tag = answer.getheader("ETag", "")
    return "" if tag.startswith(("W/", "w/")) else tag


def _checked(address: str, *, what: str) -> SplitResult:
    """Its parts; ParameterError for what is no plain address of a file or folder."""
    try:
        parts = urlsplit(address)
        fault = _fault_of(parts)
    except ValueError as error:
        raise ParameterError(f"{address!r} is no {what} ({error}).", where="dsm_urls") from error
    if fault:
        shown = address if "@" not in address else "It"
        raise ParameterError(f"{shown} is no {what} for surface models: {fault}.", where="dsm_urls")
    return parts._replace(scheme=parts.scheme.lower(), netloc=parts.netloc.lower())


def _fault_of(parts: SplitResult) -> str | None:
    if parts.scheme.lower() not in _PORTS:
        return "only http:// and https:// are read"
    if "@" in parts.netloc:
        return "a name or password does not belong into an address"
    if not parts.hostname or _port(parts) < 1:
        return "it names no server"
    if parts.query or parts.fragment:
        return "a query (?) or fragment (#) is not allowed"
    if not _PLAIN_PATH.fullmatch(parts.path) or ".." in parts.path.split("/") or "." in parts.path.split("/"):
        return "its path holds something else than plain names"
    return None


def _port(parts: SplitResult) -> int:
    return _PORTS[parts.scheme.lower()] if parts.port is None else parts.port


def _is_below(parts: SplitResult, prefix: SplitResult) -> bool:
    same = (parts.scheme, parts.hostname, _port(parts)) == (prefix.scheme, prefix.hostname, _port(prefix))
    return same and parts.path.startswith(prefix.path.rstrip("/") + "/")


def check_is_tiff(file: RemoteFile) -> None:
    """RasterFormatError for anything but a TIFF."""
    if file.read(0, 4) not in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        raise RasterFormatError(
            "This is no GeoTIFF; others are not read from a server.", where=file.name, advice="Export it as GeoTIFF."
        )
