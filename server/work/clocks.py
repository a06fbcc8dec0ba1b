"""The seconds of each step of a job, read off its reports."""

from __future__ import annotations

import time

from planning.planner.plan import CERTIFICATE_STEP, PATH_STEP, SURFACE_STEP
from server.work.jobs import Progress

READ_STEP = "Reading the surface model"
_KEYS = {READ_STEP: "read", SURFACE_STEP: "surface", PATH_STEP: "path", CERTIFICATE_STEP: "certificate"}


class StepTimer:
    """Passes progress on and keeps the wall time of each of the main steps."""

    def __init__(self, report: Progress = lambda step, share: None) -> None:
        self._report = report
        self._seconds = dict.fromkeys(_KEYS.values(), 0.0)
        self._key: str | None = None
        self._started = self._since = time.perf_counter()

    def __call__(self, step: str, share: float | None) -> None:
        key = _KEYS.get(step)
        if key is not None and key != self._key:
            self._close()
            self._key = key
        self._report(step, share)

    def seconds(self) -> dict[str, float]:
        """``read, surface, path, certificate, total`` in seconds; ends the running step."""
        self._close()
        self._key = None
        return {**self._seconds, "total": time.perf_counter() - self._started}

    def _close(self) -> None:
        now = time.perf_counter()
        if self._key is not None:
            self._seconds[self._key] += now - self._since
        self._since = now
