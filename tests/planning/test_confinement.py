"""What a confined process may still do: tried, in a process of its own, by one that wants everything."""

from __future__ import annotations

import errno
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from planning.errors import RasterError
from planning.terrain.geotiff import read_dsm
from planning.terrain.rasters import confinement, sandbox
from planning.terrain.rasters.confinement import Holds, plain_environment, what_holds
from tests.planning.geotiff_samples import hill, write_raster

_TRIES = """
import ctypes, json, os, pathlib, socket, subprocess, sys, threading

port, outside, inside = int(sys.argv[1]), sys.argv[2], sys.argv[3]
def child():
    pid = os.fork()
    if pid == 0: os._exit(0)
    os.waitpid(pid, 0)
def rename():
    pathlib.Path(inside, "a").mkdir(); pathlib.Path(inside, "b").mkdir()
    pathlib.Path(inside, "a", "x").write_text("x"); os.rename(inside + "/a/x", inside + "/b/x")
def mount():
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(0x00020000) != 0:
        raise OSError(ctypes.get_errno(), "mount")
def thread():
    one = threading.Thread(target=int); one.start(); one.join()
tries = {
    "connect": lambda: socket.create_connection(("127.0.0.1", port), 5),
    "datagram": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM),
    "unix": lambda: socket.socket(socket.AF_UNIX),
    "exec": lambda: subprocess.run(["true"], check=True),
    "fork": child,
    "kill": lambda: os.kill(os.getppid(), 0),
    "environment": lambda: pathlib.Path("/proc", str(os.getppid()), "environ").read_bytes(),
    "mount": lambda: mount(),
    "read": lambda: pathlib.Path(outside, "secret").read_text(),
    "write": lambda: pathlib.Path(outside, "written").write_text("x"),
    "read inside": lambda: pathlib.Path(inside, "given").read_text(),
    "write inside": lambda: pathlib.Path(inside, "written").write_text("x"),
    "rename inside": rename,
    "thread": thread,
}
def outcome(attempt):
    try:
        attempt()
    except OSError as error:
        return error.errno
    return "done"
"""
_CALLS = ("connect", "datagram", "unix", "environment", "mount")
_PROGRAMS = ("exec", "fork", "kill")
_OUTSIDE = ("read", "write")
_ALLOWED = ("read inside", "write inside", "rename inside", "thread")
needs_filters = pytest.mark.skipif(
    what_holds() != Holds(True, True), reason="this system has no seccomp or no Landlock"
)


@pytest.fixture
def port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield listening.getsockname()[1]


def tried(tmp_path: Path, port: int, confine: str) -> dict[str, object]:
    outside, inside = tmp_path / "outside", tmp_path / "inside"
    for folder in (outside, inside):
        folder.mkdir()
    (outside / "secret").write_text("x")
    (inside / "given").write_text("x")
    program = f"{_TRIES}\nfrom planning.terrain.rasters.confinement import *\nfrom pathlib import Path\n{confine}\n"
    program += "print(json.dumps({name: outcome(attempt) for name, attempt in tries.items()}))"
    command = [sys.executable, "-c", program, str(port), str(outside), str(inside)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


@needs_filters
def test_what_runs_no_programs_can_do_nothing_but_its_work(tmp_path: Path, port: int) -> None:
    files = "confine_files(readable=[Path(sys.prefix), Path('/usr'), Path('/lib')], writable=[Path(inside)])"
    outcomes = tried(tmp_path, port, f"confine(runs_programs=False)\n{files}")
    assert {outcomes[name] for name in (*_CALLS, *_PROGRAMS)} <= {errno.EPERM, errno.EACCES}
    assert [outcomes[name] for name in _OUTSIDE] == [errno.EACCES, errno.EACCES]
    assert [outcomes[name] for name in _ALLOWED] == ["done"] * len(_ALLOWED)


@needs_filters
def test_what_runs_programs_has_no_connections_either(tmp_path: Path, port: int) -> None:
    outcomes = tried(tmp_path, port, "confine(runs_programs=True)")
    assert {outcomes[name] for name in _CALLS} <= {errno.EPERM, errno.EACCES}
    assert {outcomes[name] for name in (*_PROGRAMS, *_OUTSIDE, *_ALLOWED)} == {"done"}


def test_the_tries_succeed_where_nothing_is_confined(tmp_path: Path, port: int) -> None:
    outcomes = tried(tmp_path, port, "")
    assert {outcomes[name] for name in ("connect", "exec", "environment", *_OUTSIDE, *_ALLOWED)} == {"done"}


@needs_filters
def test_the_decoder_of_rasters_is_confined(tmp_path: Path, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The job is replaced by the tries, after all that the worker does before it opens a file."""
    secret = tmp_path / "secret"
    secret.write_text("x")
    arguments = f"sys.argv = ['', '{port}', {str(tmp_path)!r}, os.getcwd()]"
    job = (
        "def job(job, send, ask):\n"
        "    found = {name: outcome(tries[name]) for name in ('connect', 'exec', 'read', 'environment')}\n"
        "    send('error', kind='', what=json.dumps(found), advice='')\n"
    )
    run = "from planning.terrain.rasters import decode, worker\ndecode.JOBS['read_grid'] = job\nworker.main()"
    program = f"import os, sys\n{arguments}\n{_TRIES}\n{job}\n{run}"
    monkeypatch.setattr(sandbox, "_COMMAND", [sys.executable, "-P", "-c", program])
    with pytest.raises(RasterError) as caught:
        read_dsm(write_raster(tmp_path / "x.tif", hill()))
    found = json.loads(caught.value.what)
    assert {found["connect"], found["exec"], found["environment"]} <= {errno.EPERM, errno.EACCES}
    assert found["read"] == errno.EACCES


def test_secrets_stay_at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HEDGEHOP_PASSWORD", "AWS_SECRET_ACCESS_KEY", "GITHUB_TOKEN"):
        monkeypatch.setenv(name, "x")
    kept = plain_environment()
    assert kept["PATH"] == os.environ["PATH"]
    assert not {"HEDGEHOP_PASSWORD", "AWS_SECRET_ACCESS_KEY", "GITHUB_TOKEN"} & kept.keys()


@pytest.mark.parametrize(
    ("holds", "words"),
    [
        (Holds(False, False), "memory and time only"),
        (Holds(True, False), "no Landlock"),
        (Holds(False, True), "no seccomp"),
    ],
)
def test_it_says_what_does_not_hold(holds: Holds, words: str) -> None:
    assert words in str(holds)


def test_a_filter_that_is_refused_ends_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(confinement, "_has_seccomp", lambda: True)
    monkeypatch.setattr(confinement, "_no_new_rights", lambda: None)
    monkeypatch.setattr(confinement, "_drop_capabilities", lambda: None)  # this process still needs them
    monkeypatch.setattr(confinement, "_filter", lambda *, runs_programs: b"\xff" * 8)
    with pytest.raises(confinement.ConfinementError, match="seccomp"):
        confinement.confine(runs_programs=True)


def test_errors_name_the_operators_file_and_no_directory_of_ours(tmp_path: Path) -> None:
    said = f"Cannot open {tmp_path}/0a1b2c: bad block in {tmp_path}/0a1b2c.aux; see {tmp_path.parent}/other"
    told = sandbox._public(said, tmp_path, "a\\1 b.tif")
    assert told == f"Cannot open a\\1 b.tif: bad block in a\\1 b.tif; see {tmp_path.parent}/other"
    assert sandbox._public(f"No {tmp_path}/x", tmp_path, "") == "No the file"
