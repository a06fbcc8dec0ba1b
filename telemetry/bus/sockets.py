"""Where the bus has its sockets: a directory that only this user can enter, and who is in it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import socket
import stat
import tempfile
import time
from pathlib import Path

from telemetry.errors import BusError

WELL_KNOWN = ("server", "link", "recorder", "replay", "simulator")
"""Names that are expected in every house. Each of them keeps trying to reach those before it in this row."""

_LONGEST_PATH = 107
"""bytes in sockaddr_un.sun_path, without the final zero"""
_LONGEST_NAME = 32
_LOCK = ".lock"
_FORGOTTEN_AFTER_S = 60.0


def socket_directory(runtime_dir: Path) -> Path:
    """The private directory of the sockets that belong to ``runtime_dir``: itself, if paths in it are short enough.

    Otherwise a short one elsewhere, to which ``runtime_dir/sockets`` points, so that all processes agree on it.
    Raises BusError when somebody else could enter.
    """
    private_directory(runtime_dir)
    folder = runtime_dir.resolve()
    if len(os.fsencode(folder)) + _LONGEST_NAME <= _LONGEST_PATH:
        return folder
    return _short_directory(folder)


def private_directory(path: Path) -> None:
    """Makes the directory with mode 0700 if it is not there; raises BusError if it is not ours alone."""
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = path.lstat()
    except OSError as error:
        raise BusError(
            f"The directory of the bus cannot be made ({error.strerror}).",
            where=str(path),
            advice="Choose a data directory in which you may write.",
        ) from error
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
        raise BusError(
            "The directory of the bus belongs to somebody else.",
            where=str(path),
            advice="Choose another data directory, or remove this one.",
        )
    if status.st_mode & 0o077:
        raise BusError(
            f"Other users can enter the directory of the bus (mode {status.st_mode & 0o777:04o}).",
            where=str(path),
            advice=f"Run: chmod 700 {path}",
        )


def endpoint(folder: Path, name: str) -> str:
    return f"unixsock-stream/{folder / name}.sock"


def neighbours(folder: Path, name: str) -> list[str]:
    """Names that ``name`` connects to: each pair of well-known names once, all others with everybody they find."""
    found = sorted(path.stem for path in folder.glob("*.sock") if path.stem not in WELL_KNOWN)
    guests = [other for other in found if other != name and _answers(folder / f"{other}.sock")]
    known = WELL_KNOWN[: WELL_KNOWN.index(name)] if name in WELL_KNOWN else WELL_KNOWN
    return [*known, *guests]


def remove_socket(folder: Path, name: str) -> None:
    """Clears up behind a name that does not come back. Well-known ones do, and may already have done so."""
    if name not in WELL_KNOWN:
        for path in (folder / f"{name}.sock", folder / f"{name}.sock{_LOCK}"):
            path.unlink(missing_ok=True)


def _answers(path: Path) -> bool:
    """Whether anybody listens. A socket that was left behind long ago is removed."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as probe:
        try:
            probe.connect(os.fsencode(path))
        except BlockingIOError:  # its queue is full: it lives
            return True
        except OSError:
            with contextlib.suppress(OSError):
                if time.time() - path.lstat().st_mtime > _FORGOTTEN_AFTER_S:
                    remove_socket(path.parent, path.stem)
            return False
    return True


def _short_directory(folder: Path) -> Path:
    pointer = folder / "sockets"
    digest = hashlib.sha256(os.fsencode(folder)).hexdigest()[:16]
    base = Path(os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir())
    # Whoever comes first decides: the environment of the others may name another place.
    with contextlib.suppress(FileExistsError):
        pointer.symlink_to(base / f"hedgehop-{os.geteuid()}-{digest}")
    short = Path(os.readlink(pointer))
    private_directory(short)
    if len(os.fsencode(short)) + _LONGEST_NAME > _LONGEST_PATH:
        raise BusError(
            f"The path of the bus's sockets has more than {_LONGEST_PATH - _LONGEST_NAME} characters.",
            where=str(short),
            advice="Set XDG_RUNTIME_DIR or TMPDIR to a shorter directory.",
        )
    return short
