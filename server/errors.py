"""What can go wrong at the door, as one tree, and the one table from errors to HTTP status.

ServerError
├── SignInError            no session, a wrong password, a used link
│   └── TooManyTriesError      too many passwords wait to be looked at
├── ForbiddenError         a foreign origin or host
│   ├── NotInChargeError       a command of a session that does not hold the lease
│   └── ObserverError          an observer's account would change something
├── NotFoundError          no plan, terrain, page or job of that id
├── ConflictError          what was asked for does not fit the present state
│   ├── StaleRevisionError     an edit of a plan that has changed meanwhile
│   ├── NotReadyError          an export without a finished plan
│   ├── NotCertifiedError      a plan without a certificate is not uploaded
│   ├── CheckNeededError       a start without a fresh check of what is on board and where the vehicle stands
│   ├── LateError              a command that comes later than it is good for
│   ├── InUseError             deleting what something else needs
│   └── JobCancelledError      somebody cancelled the job
├── BadRequestError        a query or body that makes no sense
├── TooLargeError          a body beyond its limit
├── StorageError           the data directory cannot be read or written
│   ├── StorageFullError       no space left
│   └── DataDirError           not usable at all: refused at start
├── BusyError              too many pages or jobs, or shutting down
├── WorkerDiedError        the process that did the work ended (killed, out of memory)
├── ClusterError           no cluster of that name, or one that cannot do the work
├── TargetError            no target of that name for a library, or one that cannot be read or written
├── DamagedError           something in such a target that is not what it is called
├── CertificateError       the console's certificate cannot be made, read or used
├── StationError           to a command: a station that runs refused what it was asked, or does not answer
└── StartError             settings or port that Hedgehop cannot start with

``telemetry.errors`` come through as they are. Like ``planning.errors``, every error says what is wrong, where, and
what to do.
"""

from __future__ import annotations

import logging

from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.exceptions import HTTPException

from mapping.errors import MappingError
from planning.errors import DescribedError, PlanningError
from server.schemas import ErrorDoc
from telemetry.errors import (
    AddressError,
    BusError,
    ConnectionFailedError,
    NotAllowedError,
    NoVehicleError,
    RecordingError,
    RecordingFullError,
    RefusedError,
    SilentError,
    StationsError,
    TelemetryError,
    TransferError,
)


class ServerError(DescribedError):
    """Base of all errors of the server."""

    code = "server"


class SignInError(ServerError):
    code = "sign_in"


class TooManyTriesError(SignInError):
    code = "too_many_tries"


class ForbiddenError(ServerError):
    code = "origin"


class NotInChargeError(ForbiddenError):
    code = "not_in_charge"


class ObserverError(ForbiddenError):
    code = "observer"


class OtherStationError(ForbiddenError):
    code = "other_station"


class NotFoundError(ServerError):
    code = "not_found"


class ConflictError(ServerError):
    code = "conflict"


class StaleRevisionError(ConflictError):
    code = "stale"


class NotReadyError(ConflictError):
    code = "not_ready"


class NotCertifiedError(ConflictError):
    code = "not_certified"


class CheckNeededError(ConflictError):
    code = "check_needed"


class LateError(ConflictError):
    code = "late"


class InUseError(ConflictError):
    code = "in_use"


class JobCancelledError(ConflictError):
    code = "cancelled"


class BadRequestError(ServerError):
    code = "invalid"


class TooLargeError(ServerError):
    code = "too_large"


class StorageError(ServerError):
    code = "storage"


class StorageFullError(StorageError):
    code = "disk_full"


class DataDirError(StorageError):
    code = "data_dir"


class BusyError(ServerError):
    code = "busy"


class WorkerDiedError(ServerError):
    code = "worker_died"


class ClusterError(ServerError):
    code = "cluster"


class TargetError(ServerError):
    code = "target"


class DamagedError(ServerError):
    code = "damaged"


class CertificateError(ServerError):
    code = "certificate"


class StationError(ServerError):
    """``code`` becomes that of the station's own answer, where it gave one."""

    code = "station"


class StartError(ServerError):
    code = "start"


STATUS: dict[type[Exception], int] = {
    MappingError: 422,
    PlanningError: 422,
    RequestValidationError: 422,
    ValidationError: 422,
    SignInError: 401,
    TooManyTriesError: 429,
    ForbiddenError: 403,
    NotFoundError: 404,
    ConflictError: 409,
    BadRequestError: 422,
    TooLargeError: 413,
    StorageError: 500,
    StorageFullError: 507,
    BusyError: 503,
    WorkerDiedError: 500,
    ClusterError: 503,
    TargetError: 502,
    DamagedError: 422,
    CertificateError: 500,
    StationError: 502,
    StartError: 503,
    TelemetryError: 502,
    AddressError: 422,
    ConnectionFailedError: 502,
    NoVehicleError: 409,
    NotAllowedError: 409,
    RefusedError: 409,
    SilentError: 504,
    TransferError: 502,
    StationsError: 409,
    RecordingError: 422,
    RecordingFullError: 507,
    BusError: 503,
}
"""Subclasses take the status of their nearest ancestor here; all that is missing is 500."""

ASK_OPERATOR = "Ask an operator to do it, or for an operator's account."
"""To an observer."""
_UNFORESEEN = "internal"
_RAISED = frozenset({"value_error", "assertion_error"})
"""pydantic's kinds for what a validator raised: it puts words of its own before the validator's."""
HTTP_CODES = {400: "invalid", 404: "not_found", 405: "method_not_allowed", 408: "too_slow", 413: "too_large"}


def status_of(error: Exception) -> int:
    if isinstance(error, HTTPException):
        return error.status_code
    return next((STATUS[cls] for cls in type(error).__mro__ if cls in STATUS), 500)


def error_doc(error: Exception) -> ErrorDoc:
    """What a page may read about an error; unforeseen ones keep their details for the log."""
    if isinstance(error, DescribedError):
        return ErrorDoc(code=error.code, what=error.what, where=error.where, advice=error.advice)
    if isinstance(error, (RequestValidationError, ValidationError)):
        return _invalid(error)
    if isinstance(error, HTTPException):
        return ErrorDoc(code=HTTP_CODES.get(error.status_code, "http"), what=str(error.detail))
    return ErrorDoc(
        code=_UNFORESEEN,
        what="Something in Hedgehop itself went wrong.",
        advice="Nothing that was saved is lost. The server's log tells what happened.",
    )


def reported(error: Exception, log: logging.Logger, doing: str) -> ErrorDoc:
    """What a page may read; what nobody foresaw goes to the log, with its traceback."""
    doc = error_doc(error)
    if doc.code == _UNFORESEEN:
        log.error("%s failed.", doing, exc_info=error)
    return doc


def _invalid(error: RequestValidationError | ValidationError) -> ErrorDoc:
    faults = error.errors()
    first = faults[0]
    place = ".".join(str(part) for part in first["loc"] if part != "body")
    more = f" ({len(faults) - 1} more such errors.)" if len(faults) > 1 else ""
    value = f" The value was {_short(first.get('input'))}." if first["type"] != "missing" else ""
    raised = first.get("ctx", {}).get("error") if first["type"] in _RAISED else None
    if isinstance(raised, DescribedError):
        where = ", ".join(part for part in (place, raised.where) if part)
        return ErrorDoc(code="invalid", what=f"{_sentence(raised.what)}{more}", where=where, advice=raised.advice)
    said = first["msg"] if raised is None else str(raised)
    return ErrorDoc(code="invalid", what=f"{_sentence(said)}{value}{more}", where=place)


def _sentence(text: str) -> str:
    return text if text.endswith((".", "?", "!")) else f"{text}."


def _short(value: object, limit: int = 60) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"
