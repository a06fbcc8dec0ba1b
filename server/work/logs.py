"""Log lines: one per event, whatever a name from outside contains."""

from __future__ import annotations

import logging
import sys


class OneLineFormatter(logging.Formatter):
    """Escapes control characters, so that no client can forge a line or drive the terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return one_line(super().format(record))


def one_line(text: str) -> str:
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)


def configure_logging(level: str) -> None:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(OneLineFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
    # A refused handshake is told by the guard, which knows why.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    logging.getLogger("uvicorn").setLevel(max(logging.getLogger().level, logging.WARNING))
