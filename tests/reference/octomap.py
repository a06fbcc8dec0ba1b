"""OctoMap itself."""

from __future__ import annotations

import importlib
from typing import Any


def octree(resolution_m: float) -> Any:
    """An empty OcTree; its package of extension modules has no types."""
    return importlib.import_module("pyoctomap").OcTree(resolution_m)
