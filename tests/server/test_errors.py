"""The one table from errors to HTTP, and what pages may read of them."""

from __future__ import annotations

import pickle
from typing import Annotated

import pytest
from pydantic import AfterValidator, BaseModel, ValidationError
from starlette.exceptions import HTTPException

from planning.errors import MissingCrsError, ParameterError
from server import errors
from server.errors import STATUS, ServerError, StaleRevisionError, StorageFullError, error_doc, status_of
from server.schemas import ErrorDoc


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


def _odd(number: int) -> int:
    if number == 2:
        raise ValueError("An odd number is needed.")
    if number == 4:
        raise ValueError("An odd number is needed")
    if number == 6:
        raise ParameterError("Six is even.", where="the number", advice="Use an odd one.")
    return number


class _Body(BaseModel):
    number: Annotated[int, AfterValidator(_odd)]


@pytest.mark.parametrize(
    ("number", "what", "where", "advice"),
    [
        (2, "An odd number is needed. The value was 2.", "number", ""),
        (4, "An odd number is needed. The value was 4.", "number", ""),
        (6, "Six is even.", "number, the number", "Use an odd one."),
        (
            "x",
            "Input should be a valid integer, unable to parse string as an integer. The value was 'x'.",
            "number",
            "",
        ),
    ],
)
def test_what_a_validator_says_is_told_in_its_own_words(number: object, what: str, where: str, advice: str) -> None:
    with pytest.raises(ValidationError) as caught:
        _Body.model_validate({"number": number})
    assert error_doc(caught.value) == ErrorDoc(code="invalid", what=what, where=where, advice=advice)


def test_every_server_error_has_a_status_and_a_code() -> None:
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, ServerError)]
    assert len({kind.code for kind in kinds}) == len(kinds)
    assert all(any(base in STATUS for base in kind.__mro__) for kind in kinds if kind is not ServerError)


def test_errors_cross_process_borders() -> None:
    error = pickle.loads(pickle.dumps(StorageFullError("Full.", where="/x", advice="Free some.")))
    assert (type(error), str(error)) == (StorageFullError, "/x: Full. Free some.")
