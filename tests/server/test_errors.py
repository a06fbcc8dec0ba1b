"""The one table from errors to HTTP, and what pages may read of them."""

from __future__ import annotations

import pickle

import pytest
from starlette.exceptions import HTTPException

from planning.errors import MissingCrsError
from server import errors
from server.errors import STATUS, ServerError, StaleRevisionError, StorageFullError, error_doc, status_of


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (MissingCrsError("No CRS.", advice="Give one."), 422, "raster_no_crs"),
        (StaleRevisionError("Changed."), 409, "stale"),
        (StorageFullError("Full."), 507, "disk_full"),
        (errors.DataDirError("No."), 500, "data_dir"),
        (HTTPException(404, "Not Found"), 404, "not_found"),
        (RuntimeError("password=1234"), 500, "internal"),
    ],
)
def test_status_and_code(error: Exception, status: int, code: str) -> None:
    assert (status_of(error), error_doc(error).code) == (status, code)
    assert "1234" not in error_doc(error).model_dump_json()


def test_every_server_error_has_a_status_and_a_code() -> None:
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ServerError)]
    assert len({kind.code for kind in kinds}) == len(kinds)
    assert all(any(base in STATUS for base in kind.__mro__) for kind in kinds if kind is not ServerError)


def test_errors_cross_process_borders() -> None:
    error = pickle.loads(pickle.dumps(StorageFullError("Full.", where="/x", advice="Free some.")))
    assert (type(error), str(error)) == (StorageFullError, "/x: Full. Free some.")
