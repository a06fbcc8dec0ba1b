"""Promises that tests of their own hold: they are run, and their row says how many passed."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import ROOT
from tests.trust.rows import Row, judged

T, S = "tests/telemetry/", "tests/server/"
HELD: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("R4", "A silent vehicle: stale at 1.5 s, lost at 3.5 s", (f"{T}test_mavlink_link.py",)),
    (
        "R5",
        "A node that hangs is said, ended and started again",
        (f"{T}test_liveness.py", f"{S}test_supervisor_hangs.py", f"{S}test_spare_node.py"),
    ),
    ("R8", "Hostile MAVLink raises nothing and costs no memory", (f"{T}test_mavlink_codec.py", f"{T}test_reduce.py")),
    ("R9", "Connections that end are opened again, and leak nothing", (f"{T}test_mavlink_connections.py",)),
    (
        "R10",
        "A killed recorder: the file opens, and the next one goes on in it",
        (f"{T}test_recorder_node.py", f"{T}test_recording_continuing.py", f"{T}test_recording_mend.py"),
    ),
    (
        "R11",
        "A full disk while recording: said, all before it readable",
        (f"{T}test_recording_recorder.py", f"{T}test_recording_disk_space.py"),
    ),
    ("R5", "A server that hangs or dies is started again", (f"{S}test_guardian.py",)),
    ("R13", "A browser that stalls holds up no other", (f"{S}test_hub.py", f"{S}test_slow_line.py")),
    ("S1", "Other sites' requests and sockets are refused", (f"{S}test_guard.py",)),
    ("S2", "Foreign hosts are refused (DNS rebinding)", (f"{S}test_guard.py",)),
    ("S3", "Hostile messages to the 3D view do nothing", (f"{S}test_filter.py", f"{S}test_proxy.py")),
    (
        "S4",
        "Hostile rasters read, ask for and delete nothing, and take no memory that others need",
        tuple(f"tests/planning/test_{name}.py" for name in ("geotiff_safety", "confinement", "memory_at_hand")),
    ),
    ("S5", "Hostile KML and KMZ are refused", ("tests/planning/test_poi_files.py",)),
    ("S6", "Huge bodies and half-open connections shut nobody out", (f"{S}test_guard.py", f"{S}test_connections.py")),
    ("S7", "Names from outside lead to no file", (f"{S}test_wrong_input.py", f"{S}test_terrains.py")),
    ("S8", "Signing: verified first, replays refused also after a restart", (f"{T}test_mavlink_signing.py",)),
    (
        "S9",
        "Commands go to the pinned peer only, and impossible changes are not believed",
        tuple(f"{T}test_mavlink_{name}.py" for name in ("peers", "adopted", "believing", "forged")),
    ),
    (
        "S10",
        "One operator in charge, held by the server and the link; observers change nothing",
        tuple(f"{S}test_{name}.py" for name in ("lease", "lease_over_the_bus", "api_roles")),
    ),
    ("S11", "Every command is written down first; changed lines are told", (f"{T}test_audit.py",)),
    ("S12", "The container: no root, nothing writable, no capabilities", ("tests/test_docker.py",)),
    (
        "S13",
        "No plain text beyond loopback; certificates of the laptop's own",
        (f"{S}test_tls.py", f"{S}test_tls_served.py"),
    ),
    ("S14", "The bus is the user's alone", (f"{T}test_bus_sockets.py",)),
    ("S15", "Names in files are text wherever they are shown", ("tests/planning/test_formats_safe_text.py",)),
)


def attempt_rows() -> Iterator[Row]:
    """All tests in one run of pytest, by file."""
    results = _results(sorted({file for _, _, files in HELD for file in files}))
    for name, promise, files in HELD:
        of_files = [results.get(file, Tried(failed=(f"{file} could not be run",))) for file in files]
        passed, skipped = sum(each.passed for each in of_files), sum(each.skipped for each in of_files)
        failed = [words for each in of_files for words in each.failed]
        figure = f"{passed} tests passed" + (f", {len(failed)} failed: {'; '.join(failed)}" if failed else "")
        figure += f", {skipped} skipped: what they try was not tried" if skipped else ""
        yield Row(name, promise, judged(passed > 0 and not failed), figure, f"pytest {' '.join(files)}")


@dataclass(frozen=True, slots=True)
class Tried:
    """A file's tests."""

    passed: int = 0
    skipped: int = 0
    failed: tuple[str, ...] = ()
    """Name and reason of each."""


def _results(files: list[str]) -> dict[str, Tried]:
    with tempfile.TemporaryDirectory(prefix="hedgehop-trust-") as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={report}", *files]
        subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
        cases = list(ElementTree.parse(report).iter("testcase")) if report.is_file() else []
    found: dict[str, Tried] = {}
    for case in cases:
        file = case.get("classname", "").replace(".", "/") + ".py"
        ends = {part.tag: part.get("message", "").partition("\n")[0] for part in case}
        words = [f"{case.get('name')} ({ends[end]})" for end in ("failure", "error") if end in ends]
        before, is_skipped = found.get(file, Tried()), "skipped" in ends
        found[file] = Tried(
            before.passed + (not words and not is_skipped), before.skipped + is_skipped, (*before.failed, *words)
        )
    return found
