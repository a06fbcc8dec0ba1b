"""The station itself: what is wrong with it, and its log of commands."""

from __future__ import annotations

from typing import Literal

from server.schemas.result_docs import ErrorDoc
from server.schemas.strict_model import Strict


class AlarmDoc(Strict):
    """Stands on every page until it is over, or until somebody has read it."""

    kind: Literal["disk", "audit", "certificate", "restart"]
    level: Literal["warning", "error"]
    began_utc_s: float
    error: ErrorDoc


class AuditEntryDoc(Strict):
    """A command, or what came of it."""

    t_utc_s: float | None
    operator: str
    words: str
    result: str
    """Empty: written down before it was sent."""


class AuditDoc(Strict):
    """The log of commands, and whether it is as it was written."""

    state: Literal["none", "whole", "broken"]
    """none: no command was given yet."""
    verdict: list[str]
    """One sentence each, the most important first."""
    lines: int
    checked_utc_s: float | None
    newest: list[AuditEntryDoc]
    """The newest first."""
