"""Log lines: one per event, whatever a name from outside contains."""

from __future__ import annotations

import logging
import sys
from collections import OrderedDict


class OneLineFormatter(logging.Formatter):
    """Escapes control characters, so that no client can forge a line or drive the terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return one_line(super().format(record))


class Repeats(logging.Filter):
    """What is said again and again is counted instead: whoever floods us does not fill the disk with our own words."""

    def __init__(self, *, most: int = 20, within_s: float = 60.0) -> None:
        super().__init__()
        self._most, self._within_s = most, within_s
        self._said: OrderedDict[tuple[str, str], list[float]] = OrderedDict()
        """Of each sentence: since when it is counted, and how often it came since."""

    def filter(self, record: logging.LogRecord) -> bool:
        if record.levelno < logging.WARNING:
            return True
        key = record.name, str(record.msg)[:200]
        counted = self._said.get(key)
        if counted is None or record.created - counted[0] >= self._within_s or record.created < counted[0]:
            unsaid = 0 if counted is None else max(0, int(counted[1]) - self._most)
            self._said[key] = [record.created, 1.0]
            self._said.move_to_end(key)
            if len(self._said) > 500:
                self._said.popitem(last=False)
            if unsaid:
                record.msg, record.args = f"{record.getMessage()} (And {unsaid} times more before.)", ()
            return True
        counted[1] += 1
        return counted[1] <= self._most


def one_line(text: str) -> str:
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)


def configure_logging(level: str) -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(OneLineFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    handler.addFilter(Repeats())
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
    # A refused handshake is told by the guard, which knows why.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    logging.getLogger("uvicorn").setLevel(max(logging.getLogger().level, logging.WARNING))
