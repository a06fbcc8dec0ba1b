"""Confines a process for the rest of its life: no connections, no look into other processes, few files, no secrets.

Two filters of the Linux kernel that need no rights: seccomp refuses system calls (x86-64 and ARM64), Landlock refuses
files. Where the system has neither, only limits of memory and time hold; ``what_holds`` says which it is.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_PR_SET_NO_NEW_PRIVS = 38
_CAPABILITIES_V3, _FILE_CAPABILITIES = 0x20080522, 0b11111
_SECCOMP_SET_FILTER, _SECCOMP_ACTION_AVAILABLE, _ALL_THREADS = 1, 2, 1
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050000, 0x80000000
_EPERM, _ENOSYS = 1, 38
# Classic BPF: load a word, jump if equal, jump if greater or equal, jump if bits are set, return.
_LOAD, _IF_EQUAL, _IF_AT_LEAST, _IF_SET, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NUMBER_AT, _ARCHITECTURE_AT, _FIRST_ARGUMENT_AT = 0, 4, 16
_X32 = 0x40000000
_CLONE_THREAD = 0x00010000

# (x86-64, ARM64); 0 where an architecture has no such call.
_SECCOMP = (317, 277)
_CONNECTIONS = {"socket": (41, 198), "connect": (42, 203), "bind": (49, 200), "listen": (50, 201)}
_OTHER_PROCESSES = {
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "pidfd_getfd": (438, 438),
}
_SYSTEM = {
    "mount": (165, 40),
    "umount2": (166, 39),
    "move_mount": (429, 429),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "unshare": (272, 97),
    "setns": (308, 268),
    "bpf": (321, 280),
    "perf_event_open": (298, 241),
    "userfaultfd": (323, 282),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
    "open_by_handle_at": (304, 265),
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "kexec_load": (246, 104),
    "io_uring_setup": (425, 425),  # its requests would pass by the filter
}
_PROGRAMS = {"execve": (59, 221), "execveat": (322, 281), "fork": (57, 0), "vfork": (58, 0)}
_SIGNALS = {
    "kill": (62, 129),
    "tkill": (200, 130),
    "rt_sigqueueinfo": (129, 138),
    "rt_tgsigqueueinfo": (297, 240),
    "pidfd_send_signal": (424, 424),
}
_CLONE, _CLONE3, _TGKILL = (56, 220), (435, 435), (234, 131)
_ARCHITECTURES = {"x86_64": (0, 0xC000003E), "aarch64": (1, 0xC00000B7)}

_LANDLOCK_CREATE, _LANDLOCK_ADD, _LANDLOCK_RESTRICT = 444, 445, 446
_LANDLOCK_VERSION, _BENEATH = 1, 1
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 14
_MAKE_SPECIAL = 1 << 6 | 1 << 9 | 1 << 10 | 1 << 11
"""Devices, sockets and pipes in the file system."""
_RENAME, _RENAMES_SINCE = 1 << 13, 2
"""From one folder to another: refused to all that are confined, unless it is asked for."""
_ALL_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1}
_ALL_RIGHTS_NOW = (1 << 15) - 1

_KEPT = frozenset(
    {"PATH", "HOME", "USER", "LANG", "LANGUAGE", "TZ", "TMPDIR", "TMP", "TEMP", "VIRTUAL_ENV", "PROJ_DATA", "PROJ_LIB"}
)
_KEPT_PREFIXES = ("LC_", "LD_", "PYTHON", "NUMBA_", "OMP_", "OPENBLAS_", "MKL_", "MALLOC_", "MPL", "XDG_")


class ConfinementError(RuntimeError):
    """The system has a filter and refuses to use it: the process must not go on."""


@dataclass(frozen=True, slots=True)
class Holds:
    """What this system can refuse to a process."""

    calls: bool
    files: bool

    def __str__(self) -> str:
        if not self.calls and not self.files:
            return (
                "This system has neither seccomp nor Landlock: "
                "workers and raster decoders are held by limits of memory and time only."
            )
        calls = (
            "Workers and raster decoders cannot open connections or look into other processes (seccomp)"
            if self.calls
            else "This system has no seccomp: connections are not refused to workers and raster decoders"
        )
        files = (
            "decoders read their own file only (Landlock)"
            if self.files
            else "it has no Landlock: decoders can read what the user can read"
        )
        return f"{calls}; {files}."


def what_holds() -> Holds:
    return Holds(calls=_has_seccomp(), files=_landlock_version() > 0)


def plain_environment() -> dict[str, str]:
    """What a child needs of our environment. Passwords and keys of whatever program stay here."""
    return {name: value for name, value in os.environ.items() if name in _KEPT or name.startswith(_KEPT_PREFIXES)}


def confine(*, runs_programs: bool) -> None:
    """No connections, no other processes' memory, nothing of the system's own; without programs, no signals either.

    Children inherit it. Raises ConfinementError when the system has the filter but does not take it.
    """
    _no_new_rights()
    _drop_capabilities()
    if _has_seccomp():
        _install(_filter(runs_programs=runs_programs))
    if _landlock_version() >= _RENAMES_SINCE:
        # No more is refused here than special files; but whoever is confined so cannot read the others' /proc entries.
        _restrict(_MAKE_SPECIAL | _RENAME, [(Path("/"), _RENAME)])


def confine_files(*, readable: Sequence[Path], writable: Sequence[Path]) -> None:
    """From now on only these files, and what lies below these folders. Nothing happens where there is no Landlock."""
    if not (version := _landlock_version()):
        return
    everything = _ALL_RIGHTS.get(version, _ALL_RIGHTS_NOW)
    rules = [(path, _EXECUTE | _READ_FILE | _READ_DIR) for path in readable]
    _restrict(everything, [*rules, *((path, everything) for path in writable)])


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _call(number: int, *arguments: object) -> int:
    wide = [ctypes.c_long(argument) if isinstance(argument, int) else argument for argument in arguments]
    return _libc().syscall(ctypes.c_long(number), *wide)


def _refused(what: str) -> ConfinementError:
    return ConfinementError(f"The system refuses to confine this process ({what}: {os.strerror(ctypes.get_errno())}).")


def _no_new_rights() -> None:
    if _libc().prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        raise _refused("no_new_privs")


def _drop_capabilities() -> None:
    """Of root, who may read every process's memory and raw packets, only the right to all files is left."""
    header, sets = (ctypes.c_uint32 * 2)(_CAPABILITIES_V3, 0), (ctypes.c_uint32 * 6)()
    if _libc().capget(header, sets) != 0:
        raise _refused("capabilities")
    # Effective, permitted and inheritable ones, of the first 32 and then of the others.
    kept = [rights & _FILE_CAPABILITIES if at < 3 else 0 for at, rights in enumerate(sets)]
    if _libc().capset(header, (ctypes.c_uint32 * 6)(*kept)) != 0:
        raise _refused("capabilities")


# seccomp


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_void_p))


def _has_seccomp() -> bool:
    if platform.machine() not in _ARCHITECTURES:
        return False
    column, _ = _ARCHITECTURES[platform.machine()]
    return _call(_SECCOMP[column], _SECCOMP_ACTION_AVAILABLE, 0, ctypes.byref(ctypes.c_uint32(_REFUSE))) == 0


def _install(instructions: bytes) -> None:
    column, _ = _ARCHITECTURES[platform.machine()]
    held = ctypes.create_string_buffer(instructions, len(instructions))
    program = _Program(len(instructions) // 8, ctypes.cast(held, ctypes.c_void_p))
    if _call(_SECCOMP[column], _SECCOMP_SET_FILTER, _ALL_THREADS, ctypes.byref(program)) != 0:
        raise _refused("seccomp")


def _filter(*, runs_programs: bool) -> bytes:
    """Refuses the listed calls, with EPERM, and lets the rest through."""
    column, architecture = _ARCHITECTURES[platform.machine()]
    groups = [_CONNECTIONS, _OTHER_PROCESSES, _SYSTEM, *([] if runs_programs else [_PROGRAMS, _SIGNALS])]
    numbers = [pair[column] for group in groups for pair in group.values() if pair[column]]
    refuse = _step(_RETURN, _REFUSE | _EPERM)
    program = [
        _step(_LOAD, _ARCHITECTURE_AT),
        _step(_IF_EQUAL, architecture, 1, 0),
        _step(_RETURN, _KILL),
        _step(_LOAD, _NUMBER_AT),
        # The other numbering of x86-64's calls; no program of today uses it.
        _step(_IF_AT_LEAST, _X32, 0, 1),
        refuse,
    ]
    for number in numbers:
        program += [_step(_IF_EQUAL, number, 0, 1), refuse]
    if not runs_programs:
        # Threads are no new processes. What clone3 makes stands behind a pointer: libraries then take clone.
        program += [_step(_IF_EQUAL, _CLONE3[column], 0, 1), _step(_RETURN, _REFUSE | _ENOSYS)]
        program += [_step(_IF_EQUAL, _CLONE[column], 0, 3), _step(_LOAD, _FIRST_ARGUMENT_AT)]
        program += [_step(_IF_SET, _CLONE_THREAD, 1, 0), refuse, _step(_LOAD, _NUMBER_AT)]
        program += [_step(_IF_EQUAL, _TGKILL[column], 0, 3), _step(_LOAD, _FIRST_ARGUMENT_AT)]
        program += [_step(_IF_EQUAL, os.getpid(), 1, 0), refuse]
    return b"".join([*program, _step(_RETURN, _ALLOW)])


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("=HBBI", code, if_true, if_false, value)


# Landlock


class _Ruleset(ctypes.Structure):
    _fields_ = (("handled", ctypes.c_uint64),)


class _Beneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed", ctypes.c_uint64), ("folder", ctypes.c_int32))


def _landlock_version() -> int:
    """0: there is none."""
    return max(0, _call(_LANDLOCK_CREATE, None, 0, _LANDLOCK_VERSION))


def _restrict(handled: int, rules: Sequence[tuple[Path, int]]) -> None:
    ruleset = _Ruleset(handled)
    handle = _call(_LANDLOCK_CREATE, ctypes.byref(ruleset), ctypes.sizeof(ruleset), 0)
    if handle < 0:
        raise _refused("Landlock")
    try:
        for path, allowed in rules:
            _allow(handle, path, allowed & handled)
        _no_new_rights()
        if _call(_LANDLOCK_RESTRICT, handle, 0) != 0:
            raise _refused("Landlock")
    finally:
        os.close(handle)


def _allow(ruleset: int, path: Path, allowed: int) -> None:
    try:
        handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return  # what is not there needs no rule
    try:
        if not path.is_dir():
            allowed &= _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE
        rule = _Beneath(allowed, handle)
        if _call(_LANDLOCK_ADD, ruleset, _BENEATH, ctypes.byref(rule), 0) != 0:
            raise _refused("Landlock")
    finally:
        os.close(handle)
