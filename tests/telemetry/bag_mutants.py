"""Damages bags at random and reads each as the decoding process does, within its limits of memory; prints what came.

``python -m tests.telemetry.bag_mutants FOLDER COUNT``: a process of its own, since what is read may be hostile.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from telemetry.errors import RecordingError
from telemetry.recording.ros import decode
from telemetry.recording.ros.bag import contents_of
from telemetry.recording.ros.placing import placed
from tests.telemetry.bags import KINDS, T0_NS, Entry, Messages, write_bag

MOST_BYTES, MOST_S = 3 * 2**30, 30


def main(folder: Path, count: int) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    whole = {kind: write_bag(folder, kind, entries(kind), kind) for kind in KINDS}
    found: dict[str, Any] = {"placed": 0, "refused": 0, "faults": []}
    for number in range(count):
        kind = KINDS[number % len(KINDS)]
        rng = np.random.default_rng(number)
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            damaged = mutant(whole[kind], Path(scratch), rng)
            signal.alarm(MOST_S)  # a hang kills the process, and with it the test
            outcome = read(damaged, kind, Path(scratch), table=number % 2 == 0)
            signal.alarm(0)
        if outcome in ("placed", "refused"):
            found[outcome] += 1
        else:
            found["faults"].append(f"{kind} {number}: {outcome}")
    print(json.dumps(found))


def entries(kind: str) -> list[Entry]:
    m, found = Messages(kind), list[Entry]()
    found.append(("/tf_static", T0_NS, m.tf(T0_NS, "base_link", "radar", [1, 0, 0], (1, 0, 0, 0))))
    for k in range(12):
        t_ns = T0_NS + k * 100_000_000
        found.append(("/odom", t_ns, m.odometry(t_ns, "odom", "base_link", [k, 0, 10], (1, 0, 0, 0))))
        found.append(("/points", t_ns, m.cloud(t_ns, "radar", {"x": np.arange(9), "y": np.ones(9), "z": np.ones(9)})))
    return found


def mutant(bag: Path, scratch: Path, rng: np.random.Generator) -> Path:
    """The one file of a bag with bytes changed, cut off, left out or doubled."""
    file = bag if bag.is_file() else next(iter(sorted(bag.glob("*.db3")) + sorted(bag.glob("*.mcap"))))
    data = bytearray(file.read_bytes())
    at = int(rng.integers(0, len(data)))
    how = int(rng.integers(0, 5))
    if how == 0:
        del data[at:]
    elif how == 1:
        del data[at : at + int(rng.integers(1, 400))]
    elif how == 2:
        data[at:at] = data[max(0, at - 300) : at]
    elif how == 3:
        data[at : at + 4] = int(rng.choice([0, 0xFFFFFFFF, 0x7FFFFFFF, 0xFFFFFF00])).to_bytes(4, "little")
    else:
        for place in rng.integers(0, len(data), int(rng.integers(1, 60))).tolist():
            data[place] = int(rng.integers(0, 256))
    out = scratch / file.name
    out.write_bytes(data)
    return out


def read(path: Path, kind: str, directory: Path, *, table: bool) -> str:
    """placed, refused, or what must not have happened."""
    job = {"source": str(path), "format": kind, "directory": str(directory)}
    wanted = {"points": "/points", "pose": "/odom", "topics": ["/points", "/odom"]}
    said: list[tuple[str, dict[str, Any]]] = []
    try:
        for name in ["list_bag", "read_bag"] if table else ["read_bag"]:
            decode.JOBS[name](job | wanted, lambda word, **fields: said.append((word, fields)), lambda header: header)
        word, fields = said[-1]
        if word == "error":
            return "refused" if fields["what"] and fields["advice"] else f"no words: {fields}"
        placed(contents_of(directory, json.loads(json.dumps(fields))))
    except (MemoryError, OSError, RecordingError):  # the first two are told by the worker
        return "refused"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return "placed"


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
