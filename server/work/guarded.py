"""The server's end of the guardian's socket pair: what it learns from there, and its proofs that it works."""

from __future__ import annotations

import faulthandler
import json
import logging
import os
import signal
import socket
import sys
import time
from datetime import UTC, datetime

from server.schemas import ErrorDoc
from server.work.guardian import CHANNEL, LINK_OPEN, LINK_USED

log = logging.getLogger("hedgehop.guarded")


class Guarded:
    """All methods belong to the event loop's thread; none of them waits, once it is made."""

    def __init__(self, channel: socket.socket) -> None:
        """Waits for its turn: the first server has it at once, a spare one when that has gone."""
        with channel.makefile("rb") as greeting:
            line = greeting.readline()
        if not line:
            sys.exit(0)  # never needed
        told = json.loads(line)
        channel.setblocking(False)
        self._channel = channel
        self._is_alone = False
        self.link_token: str | None = told["link"]
        """The sign-in link that was printed, as long as nobody has used it."""
        self._silent_since_s: float | None = told["silent_since_t_mono_s"]

    @classmethod
    def found(cls) -> Guarded | None:
        """None: nobody has started this server but a person, or a test."""
        number = os.environ.pop(CHANNEL, "")
        if not number:
            return None
        channel = socket.socket(fileno=int(number))
        os.set_inheritable(channel.fileno(), False)
        # What it hangs in is written to the log before it is ended, even if no line of Python runs any more.
        faulthandler.register(signal.SIGUSR1, all_threads=True)
        return cls(channel)

    def notice(self) -> ErrorDoc | None:
        """For the pages of a server that is there again."""
        if self._silent_since_s is None:
            return None
        silent_s = max(1.0, time.monotonic() - self._silent_since_s)
        doc = ErrorDoc(
            code="server_restarted",
            what=f"The server did not answer for {silent_s:.0f} s and was started again "
            f"at {datetime.now(UTC):%H:%M:%S} UTC.",
            advice="The link and the recording went on without it. Look where the vehicle is; the log tells the cause.",
        )
        log.warning(doc.what)
        return doc

    def prove(self, *, link_is_open: bool, in_flight: bool) -> bool:
        """Twice a second. False: the guardian has gone, and the server must end; not while a vehicle is in flight."""
        try:
            self._channel.send(LINK_OPEN if link_is_open else LINK_USED)
        except BlockingIOError:
            pass  # the guardian was stopped for long; it will read them
        except OSError:
            if not in_flight:
                log.warning("The guardian of this server has gone: it ends.")
                return False
            if not self._is_alone:
                log.error("The guardian of this server has gone. The server goes on until the vehicle is disarmed.")
            self._is_alone = True
        return True
