"""Errors on their way through the bus: a ``DescribedError`` becomes an ``ErrorInfo`` and is raised again elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

from planning.errors import DescribedError
from telemetry.errors import BusError
from telemetry.messages import ErrorInfo


def error_info(error: DescribedError) -> ErrorInfo:
    return ErrorInfo(error.code, error.what, error.where, error.advice)


def error_of(info: ErrorInfo) -> DescribedError:
    """The error again, of the class that has its code; a ``BusError`` when this process knows no such class."""
    return _class_of(info.code)(info.what, where=info.where, advice=info.advice)


def _class_of(code: str) -> type[DescribedError]:
    # Classes of other floors appear when their modules are imported, so the table is not made once for all.
    return next((cls for cls in _subclasses(DescribedError) if cls.code == code), BusError)


def _subclasses(cls: type[DescribedError]) -> Iterator[type[DescribedError]]:
    for child in cls.__subclasses__():
        yield child
        yield from _subclasses(child)
