"""Where a library is shared: a folder of any disk, or whatever fsspec opens by a URL (S3 and the like, an extra).

Below ``FOLDER`` lie ``blobs/ab/abcd...`` and ``items/abcd....json``, each named by the SHA-256 of its bytes. Nothing is
ever deleted, and a name is written anew only where a shorter or longer file shows that its writer broke off.
The only module that knows fsspec.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
import stat
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import unquote

from server.errors import TargetError
from server.library.whole_files import TEMPORARY, new_id, sync_directory

FOLDER = "hedgehop-library-1"
"""With the format's number: what a later Hedgehop writes otherwise stands beside it."""
BLOBS, ITEMS, DAMAGED = "blobs", "items", "damaged"
_STALE_S = 24 * 3600.0
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


class Target(Protocol):
    """Blocking calls, for any thread. All raise TargetError when the target cannot be reached, read or written."""

    text: str
    """As people know it, without secrets."""
    threads: int
    """Calls that are worth making at a time."""

    def sizes(self, folder: str) -> dict[str, int]:
        """Bytes of each file anywhere below ``folder``, by its own name; empty when there is no such folder."""
        ...

    def read(self, path: str, most_bytes: int) -> bytes:
        """At most one byte more than ``most_bytes``: enough to see that it is too long."""
        ...

    def write(self, path: str, data: bytes) -> None: ...

    def set_aside(self, name: str) -> bool:
        """Moves a damaged item to ``DAMAGED``; False: it is younger than a day, and may be on its way, or has gone."""
        ...

    def settle(self) -> None:
        """Returns once all that was written would survive a power cut."""
        ...


def blob_path(digest: str) -> str:
    return f"{BLOBS}/{digest[:2]}/{digest}"


def item_path(name: str) -> str:
    return f"{ITEMS}/{name}"


def open_target(text: str) -> Target:
    """Raises TargetError for what names none, and for what is not installed."""
    scheme, found, _ = text.partition("://")
    if not found:
        return FolderTarget(Path(text).expanduser().absolute())
    host, _, path = text[len(scheme) + 3 :].partition("/")
    secret = "@" in host or ":" in host or "?" in text
    if secret or "::" in text:  # by the text alone: a secret with / or ? in it is cut elsewhere by who parses it
        named = "URLs with a user, a password, a port or a query" if secret else "Chained URLs"
        advice = "Give secrets where the store's own client looks for them: its files, or the environment."
        raise TargetError(f"{named} are not taken.", where=f"{scheme.rpartition(':')[2]}://", advice=advice)
    if scheme != "file":
        return StoreTarget(text)
    if host not in ("", "localhost"):
        what, advice = "A file's URL names no host.", "Write file:///folder, or the folder itself."
        raise TargetError(what, where=text, advice=advice)
    return FolderTarget(Path(f"/{unquote(path)}").absolute())


class FolderTarget:
    """Files are written aside, synced and renamed: whole or not there, also on a stick that is pulled out."""

    threads = 2

    def __init__(self, folder: Path) -> None:
        self.folder, self.text = folder, str(folder)
        self._root = folder / FOLDER
        self._unsettled: set[Path] = set()
        if not folder.is_dir():
            advice = "Check that the disk is there; make the folder if it is to be a new one."
            raise TargetError("There is no such folder.", where=self.text, advice=advice)
        with _told(self.text):
            for path in (self._root, *(self._root / name for name in (BLOBS, ITEMS, DAMAGED))):
                if path.is_symlink():
                    advice = "Remove the link; links are not followed in a target."
                    raise TargetError("This is a link to elsewhere.", where=str(path), advice=advice)

    def sizes(self, folder: str) -> dict[str, int]:
        with _told(self.text):
            return {
                entry.name: entry.stat(follow_symlinks=False).st_size
                for entry in _files(self._root / folder)
                if Path(entry.path) == self._root / _place(folder, entry.name)
            }

    def read(self, path: str, most_bytes: int) -> bytes:
        with _told(self.text):
            handle = os.open(self._root / path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            with open(handle, "rb") as file:
                if not stat.S_ISREG(os.fstat(handle).st_mode):
                    raise OSError(errno.EINVAL, "no regular file", path)
                return file.read(most_bytes + 1)

    def write(self, path: str, data: bytes) -> None:
        place = self._root / path
        with _told(self.text):
            self._make(place.parent)
            aside = place.with_name(f"{TEMPORARY}{place.name}-{new_id()}")
            try:
                handle = os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
                with open(handle, "wb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(handle)
                os.replace(aside, place)
            except BaseException:
                with contextlib.suppress(OSError):
                    aside.unlink(missing_ok=True)
                raise
        self._unsettled.add(place.parent)

    def settle(self) -> None:
        with _told(self.text):
            while self._unsettled:
                self._sync(self._unsettled.pop())

    def tidy(self) -> None:
        """Removes what writers left half-written a day ago or earlier; a younger one may still be at work."""
        with _told(self.text):
            for entry in list(_files(self._root, temporary=True)):
                with contextlib.suppress(OSError):  # another's, or renamed meanwhile
                    if _age_s(entry.stat(follow_symlinks=False)) > _STALE_S:
                        os.unlink(entry.path)

    def set_aside(self, name: str) -> bool:
        item, aside = self._root / item_path(name), self._root / DAMAGED / name
        with _told(self.text):
            try:
                if _age_s(item.lstat()) <= _STALE_S:
                    return False
                self._make(aside.parent)
                os.replace(item, aside)
            except FileNotFoundError:  # another push was first
                return False
        self._unsettled |= {item.parent, aside.parent}
        return True

    def _make(self, folder: Path) -> None:
        if folder.is_symlink():
            raise OSError(errno.ELOOP, "A folder is a link to elsewhere", str(folder))
        if folder.is_dir():
            return
        folder.mkdir(parents=True, exist_ok=True)
        self._unsettled |= {above for above in folder.parents if above.is_relative_to(self.folder)}

    @staticmethod
    def _sync(folder: Path) -> None:
        try:
            sync_directory(folder)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems sync no folders
                raise


class StoreTarget:
    """Through fsspec. What a store leaves half-written has another size or hash, and counts as missing."""

    threads = 4

    def __init__(self, url: str) -> None:
        scheme = url.partition("://")[0]
        self.text = url
        try:
            fsspec = importlib.import_module("fsspec")
            self._fs: Any
            self._fs, root = fsspec.core.url_to_fs(url)
        except ImportError as error:
            what = f"What opens {scheme}:// is not installed: {error}."
            advice = "Install the extra: pip install 'hedgehop[store]'. A folder works without it."
            raise TargetError(what, where=url, advice=advice) from error
        except Exception as error:  # each store has errors of its own
            what = f"The target cannot be opened: {_reason(error)}."
            raise TargetError(what, where=url, advice="Check the URL, such as s3://bucket/prefix.") from error
        self._root = f"{root.rstrip('/')}/{FOLDER}"

    def sizes(self, folder: str) -> dict[str, int]:
        with _told(self.text):
            self._fs.invalidate_cache()
            try:
                found = self._fs.find(f"{self._root}/{folder}", detail=True)
            except FileNotFoundError:
                return {}
            named = [(path, path.rpartition("/")[2], info) for path, info in found.items()]
            return {
                name: int(info["size"] or 0) for path, name, info in named if path.endswith(f"/{_place(folder, name)}")
            }

    def read(self, path: str, most_bytes: int) -> bytes:
        with _told(self.text):
            return bytes(self._fs.cat_file(f"{self._root}/{path}", start=0, end=most_bytes + 1))

    def write(self, path: str, data: bytes) -> None:
        place = f"{self._root}/{path}"
        with _told(self.text):
            try:
                self._fs.pipe_file(place, data)
            except FileNotFoundError:  # a store with real folders; of S3 this would make buckets
                self._fs.makedirs(place.rpartition("/")[0], exist_ok=True)
                self._fs.pipe_file(place, data)

    def set_aside(self, name: str) -> bool:
        item = f"{self._root}/{item_path(name)}"
        with _told(self.text):
            try:
                age_s = time.time() - self._fs.modified(item).timestamp()
                if age_s <= _STALE_S:
                    return False
                self._fs.makedirs(f"{self._root}/{DAMAGED}", exist_ok=True)
                self._fs.mv(item, f"{self._root}/{DAMAGED}/{name}")
            except (FileNotFoundError, NotImplementedError):  # another push was first; a store that tells no times
                return False
        return True

    def settle(self) -> None:
        """A store answers once it has it."""


def _files(folder: Path, *, temporary: bool = False) -> Iterator[os.DirEntry[str]]:
    try:
        entries = list(os.scandir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            yield from _files(Path(entry.path), temporary=temporary)
        elif entry.is_file(follow_symlinks=False) and entry.name.startswith(TEMPORARY) == temporary:
            yield entry


def _place(folder: str, name: str) -> str:
    """Where alone a file of this name counts: a copy beside it is never read."""
    return blob_path(name) if folder == BLOBS else f"{folder}/{name}"


def _age_s(status: os.stat_result) -> float:
    return time.time() - status.st_mtime


def _reason(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(text).split())[:300].rstrip(".")


@contextlib.contextmanager
def _told(where: str) -> Iterator[None]:
    """Turns whatever a disk or a store raises into TargetError."""
    try:
        yield
    except TargetError:
        raise
    except OSError as error:
        full = error.errno in _FULL
        what = "The target is full." if full else f"The target cannot be used: {_reason(error)}."
        advice = "Free some space" if full else "Check the disk or the network"
        raise TargetError(what, where=where, advice=f"{advice}, and run the command again: it goes on.") from error
    except Exception as error:  # each store has errors of its own
        what = f"The target cannot be used: {_reason(error)}."
        advice = "Check the network and the rights, and run the command again: it goes on."
        raise TargetError(what, where=where, advice=advice) from error
