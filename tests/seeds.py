"""One test for many seeds: what pytest does around each test would take longer than they do."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

Test = Callable[..., None]


def seeds(count: int) -> Callable[[Test], Test]:
    """The test with ``seed`` from 0 on, ``count`` times; a failure names its seed."""

    def every(test: Test) -> Test:
        @functools.wraps(test)
        def whole(**given: Any) -> None:
            for seed in range(count):
                try:
                    test(**given, seed=seed)
                except BaseException as error:
                    error.add_note(f"seed={seed}")
                    raise

        signature = inspect.signature(test)
        kept = [parameter for name, parameter in signature.parameters.items() if name != "seed"]
        whole.__signature__ = signature.replace(parameters=kept)  # pyright: ignore[reportAttributeAccessIssue]
        return whole

    return every
