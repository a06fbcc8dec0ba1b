"""BlueSky's Modified Voltage Potential, unchanged and by itself: without the air traffic simulation around it."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np

from mapping.geometry.arrays import F64

SCALE = 100.0
"""BlueSky is for aircraft: nearer than 10 m two of them are head on to it. So all lengths are made as much larger."""
AFAR_M = 1e6


def is_installed() -> bool:
    return importlib.util.find_spec("bluesky") is not None


def mvp() -> Any:
    """The class, its two imports of the simulation replaced by what it needs of them: a decorator and a base."""
    spec = importlib.util.find_spec("bluesky")
    assert spec is not None
    assert spec.submodule_search_locations is not None
    path = Path(spec.submodule_search_locations[0]) / "traffic" / "asas" / "mvp.py"
    stack = SimpleNamespace(command=lambda **_: lambda function: function)
    names = {
        "bluesky": _module("bluesky", stack=stack),
        "bluesky.traffic": _module("bluesky.traffic"),
        "bluesky.traffic.asas": _module("bluesky.traffic.asas", ConflictResolution=object),
    }
    own = importlib.util.spec_from_file_location("bluesky_mvp_alone", path)
    assert own is not None
    assert own.loader is not None
    made = importlib.util.module_from_spec(own)
    with mock.patch.dict(sys.modules, names):
        own.loader.exec_module(made)
    return made.MVP


def _module(name: str, **contents: Any) -> ModuleType:
    made = ModuleType(name)
    vars(made).update(contents)
    return made


class Mvp:
    """``change`` of the own velocity that resolves one conflict in the plane."""

    def __init__(self) -> None:
        self._resolve = mvp().MVP
        self._switches = SimpleNamespace(resofach=1.0, resofacv=1.0)

    def change(
        self, offset_m: F64, own_m_s: F64, other_m_s: F64, *, radius_m: float, within_s: float, after_s: float
    ) -> F64:
        """(2,) East and north, to be added; ``after_s``: to the closest approach."""
        own, other = _craft(own_m_s), _craft(other_m_s)
        conflict = SimpleNamespace(
            rpz=np.full(2, SCALE * radius_m), hpz=np.full(2, AFAR_M), dtlookahead=np.full(2, within_s)
        )
        bearing_deg = float(np.degrees(np.arctan2(*offset_m)))
        range_m = SCALE * float(np.hypot(*offset_m))
        with np.errstate(invalid="ignore"):  # of its vertical part, which is not used
            found, _ = self._resolve(
                self._switches, own, other, conflict, bearing_deg, range_m, after_s, max(after_s, 0.1), 0, 1
            )
        return -np.asarray(found[:2], np.float64) / SCALE


def _craft(velocity_m_s: F64) -> SimpleNamespace:
    east, north = SCALE * velocity_m_s
    return SimpleNamespace(gseast=np.full(2, east), gsnorth=np.full(2, north), vs=np.zeros(2), alt=np.zeros(2))
