"""Starts the server, and starts it again when it dies or hangs: ``python -m server.work.guardian COMMAND...``.

It is small, so that it lasts: one thread, the standard library, no port, no disk. The server proves over a socket pair,
twice a second and from its event loop, that it works (``server.work.guarded``); nodes and their vehicle's heartbeat go
on meanwhile. The guardian holds no listening socket: while there is no server, pages are refused at once and say so,
instead of waiting in a queue that nobody serves. Beside a server that has run for a while a spare one waits, with all
its modules loaded.

It ends when it is asked to (SIGINT, SIGTERM, SIGHUP), and with a server that never came up, with that one's exit code.
As process 1 of a container it also reaps what others leave.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import signal
import socket
import sys
import time
from typing import NoReturn

from telemetry.bus.liveness import Liveness

CHANNEL = "HEDGEHOP_GUARDIAN"
"""Environment variable: the number of the server's end of the socket pair."""
LINK_OPEN, LINK_USED = b"o", b"u"
"""A proof, which also says whether the sign-in link still waits to be used."""
PAUSES_S = (0.0, 1.0, 2.0, 5.0, 10.0)
"""Before it is started again: at once after a server that ran for long, slower and slower after one that did not."""
STEADY_S = PAUSES_S[-1]
SPARE_AFTER_S, SPARE_AGAIN_S = 10.0, 60.0
"""Once the server answers, and after a spare one that ended: loading it takes processor time from others."""
_BUSY_S, _START_S = 30.0, 180.0
"""Given up though it works hard, or before it answers for the first time; a machine may be very slow."""
_LOOK_EVERY_S = 0.1
_TELLS_WITHIN_S = 0.3
_END_WITHIN_S = 25.0


class _Server:
    """One server's process, as long as it runs. It loads its modules, then waits until it is greeted."""

    def __init__(self, command: list[str]) -> None:
        self.channel, theirs = socket.socketpair()
        self.channel.setblocking(False)
        theirs.set_inheritable(True)
        # In a group of its own: Ctrl-C reaches the guardian alone, which passes it on once.
        environment = {**os.environ, CHANNEL: str(theirs.fileno())}
        try:
            self.pid = os.posix_spawn(command[0], command, environment, setpgroup=0)
        except OSError as error:  # no memory, perhaps: it is tried again as one that ended at once
            _log(f"The server cannot be started: {error.strerror}.")
            self.pid = 0
        theirs.close()
        self.started_s = self.proved_t_mono_s = time.monotonic()
        self.has_answered = False
        self.link_is_open = True
        self.code: int | None = None if self.pid else 1
        """As ``os.waitstatus_to_exitcode`` has it; None while it runs."""

    def greet(self, greeting: dict[str, object]) -> None:
        """It is its turn."""
        self.started_s = self.proved_t_mono_s = time.monotonic()
        with contextlib.suppress(OSError):  # it has ended meanwhile, which is seen as with any other
            self.channel.send(json.dumps(greeting).encode() + b"\n")

    def hear(self, timeout_s: float) -> None:
        """Takes its proofs. Waits for the first one, but no longer than this."""
        if not select.select([self.channel], [], [], timeout_s)[0]:
            return
        with contextlib.suppress(OSError):
            if proofs := self.channel.recv(4096):
                self.proved_t_mono_s, self.has_answered = time.monotonic(), True
                self.link_is_open = proofs.endswith(LINK_OPEN)
                return
        time.sleep(timeout_s)  # its end is closed: it is ending, or did so at once

    def signal(self, number: int) -> None:
        if self.code is None:  # not reaped: its number is still its own
            os.kill(self.pid, number)


class Guardian:
    def __init__(self, command: list[str]) -> None:
        self._command = command
        self._link: str | None = base64.urlsafe_b64encode(os.urandom(32)).decode().rstrip("=")
        """Token of the sign-in link, until it is used."""
        self._silent_since_s: float | None = None
        """When a server was last heard that has gone since."""
        self._restarts = self._failures = 0
        self._spare: _Server | None = None
        self._spare_ended_s = -SPARE_AGAIN_S
        self._signals: list[int] = []
        self._asked_s: float | None = None

    def run(self) -> int:
        """The exit code of the last server."""
        try:
            return self._run()
        finally:
            if self._spare is not None:
                self._spare.signal(signal.SIGKILL)

    def _run(self) -> int:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:  # nohup means it
                signal.signal(number, self._on_signal)
        while True:
            self._reap(self._spare)  # it may have ended with the server, as when memory runs out
            self._drop_dead_spare()
            server, self._spare = self._spare or _Server(self._command), None
            server.greet({"link": self._link, "silent_since_t_mono_s": self._silent_since_s})
            how = self._watch(server)
            if self._asked_s is not None or not (server.has_answered or self._restarts):
                return server.code or 0
            pause_s = self._pause_s(server)
            when = f"in {pause_s:.0f} s" if pause_s else "now"
            _log(f"The server {how}. It is started again {when}; restart {self._restarts} since this command began.")
            until_s = time.monotonic() + pause_s
            while time.monotonic() < until_s and self._asked_s is None:
                time.sleep(_LOOK_EVERY_S)
            if self._asked_s is not None:
                return 0

    def _watch(self, server: _Server) -> str:
        """Until it has ended. Returns how it did, in words that follow "The server"."""
        liveness = Liveness(busy_s=_BUSY_S, start_s=_START_S)
        # Looked at before it is heard: else its first proof would be taken for its start, and waited for longer.
        liveness.look(server, server.started_s)
        hung = ""
        while self._runs(server):
            server.hear(_LOOK_EVERY_S)
            self._pass_on(server)
            self._keep_spare(server)
            silence = liveness.look(server, time.monotonic())
            # The first start of all is watched by whoever asked for it; one that was asked to end says nothing more.
            watched = self._asked_s is None and (server.has_answered or self._restarts)
            if watched and silence.is_hung and not hung:
                hung = f"did not answer for {silence.silent_s:.0f} s"
                _log(f"The server {hung} and is ended. What its threads were doing:")
                server.signal(signal.SIGUSR1)
                time.sleep(_TELLS_WITHIN_S)
                server.signal(signal.SIGKILL)
            elif self._asked_s is not None and time.monotonic() - self._asked_s > _END_WITHIN_S:
                server.signal(signal.SIGKILL)
        server.hear(0.0)  # what it proved just before it ended
        server.channel.close()
        return hung or f"ended {_ending(server.code or 0)}"

    def _runs(self, server: _Server) -> bool:
        self._reap(server, self._spare)
        return server.code is None

    @staticmethod
    def _reap(*servers: _Server | None) -> None:
        """Whatever has ended: process 1 of a container inherits the nodes of a server that died."""
        with contextlib.suppress(ChildProcessError):
            while (ended := os.waitpid(-1, os.WNOHANG))[0]:
                for each in servers:
                    if each is not None and ended[0] == each.pid:
                        each.code = os.waitstatus_to_exitcode(ended[1])

    def _drop_dead_spare(self) -> None:
        if self._spare is not None and self._spare.code is not None:
            self._spare.channel.close()
            self._spare, self._spare_ended_s = None, time.monotonic()

    def _keep_spare(self, server: _Server) -> None:
        self._drop_dead_spare()
        now_s = time.monotonic()
        is_steady = server.has_answered and now_s - server.started_s > SPARE_AFTER_S
        may_try = is_steady and self._asked_s is None and now_s - self._spare_ended_s > SPARE_AGAIN_S
        if self._spare is None and may_try:
            self._spare = _Server(self._command)

    def _pause_s(self, server: _Server) -> float:
        if server.has_answered:
            self._silent_since_s = server.proved_t_mono_s
            self._link = self._link if server.link_is_open else None
            if server.proved_t_mono_s - server.started_s > STEADY_S:
                self._failures = 0
        self._failures, self._restarts = self._failures + 1, self._restarts + 1
        return PAUSES_S[min(self._failures, len(PAUSES_S)) - 1]

    def _pass_on(self, server: _Server) -> None:
        while self._signals:
            number = self._signals.pop(0)
            # A terminal that has gone is no reason to end without having saved.
            server.signal(signal.SIGTERM if number == signal.SIGHUP else number)

    def _on_signal(self, number: int, _frame: object) -> None:
        self._signals.append(number)
        self._asked_s = self._asked_s or time.monotonic()


def _ending(code: int) -> str:
    return f"with code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"


def _log(text: str) -> None:
    t_utc_s = time.time()
    stamp = f"{time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(t_utc_s))},{int(t_utc_s % 1 * 1000):03d}"
    with contextlib.suppress(OSError):  # whoever read it may have gone
        sys.stderr.write(f"{stamp} WARNING hedgehop.guardian: {text}\n")
        sys.stderr.flush()


def become_guardian(*more: str) -> NoReturn:
    """Of this same command, with ``more`` arguments: this process is replaced, its number and terminal stay."""
    module = Guardian.__module__
    os.execv(sys.executable, [sys.executable, "-m", module, sys.executable, *sys.orig_argv[1:], *more])


def main() -> None:
    code = Guardian(sys.argv[1:]).run()
    if code < 0:
        # Ended by a signal, as the server was; process 1 of a container cannot be.
        if -code != signal.SIGKILL:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
        code = 128 - code
    sys.exit(code)


if __name__ == "__main__":
    main()
