"""A target's library to this one: each file is whole and proven before it gets its name; nothing here is replaced."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

from server.errors import DamagedError, DataDirError, StorageError, StorageFullError, TargetError
from server.library.directory_lock import locked
from server.library.sharing.catalog import Catalog, read_catalog
from server.library.sharing.chosen import Wanted, choose, compare
from server.library.sharing.fetch import OnChunk, fetch_file
from server.library.sharing.local_items import FOLDERS, local_items
from server.library.sharing.outcome import Done, LeftOut, Outcome, Tell
from server.library.sharing.proving import prove
from server.library.sharing.push import check_apart, save_versions
from server.library.sharing.seen_wanted import with_needed_columns
from server.library.sharing.shared_items import WORDS
from server.library.sharing.sharing_targets import ITEMS, Target
from server.library.sharing.versions import Versions
from server.library.whole_files import TEMPORARY, new_id, storage_errors, sync_directory

STAGING = "pulling"
"""Of the data directory: what is on its way; a pull that broke off goes on there."""
STEP = "Bringing"
SPARE_BYTES = 64 * 1024**2
"""Left free on the disk."""
_NO_LINKS = {errno.EPERM, errno.EACCES, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS}
"""What file systems without a second name for a file answer."""
_COPY_BYTES = 8 * 1024**2


def pull(root: Path, target: Target, outcome: Outcome, tell: Tell, *, dry_run: bool = False) -> None:
    """Fills ``outcome`` as it goes. Needs the data directory for itself, unless it is a ``dry_run``.

    Raises DataDirError, TargetError, StorageFullError where nothing could be begun; a target that fails or a disk that
    fills up later stops it. What is damaged in the target is said, and the others are brought.
    """
    check_apart(root, target)
    catalog = read_catalog(target, tell)
    if not catalog.item_sizes:
        what = "No library was pushed here."
        raise TargetError(what, where=target.text, advice="Check the target, or push to it first.")
    outcome.left_out += catalog.faults
    with nullcontext() if dry_run else _own(root):
        _pull(root, target, catalog, outcome, tell, dry_run=dry_run)


def _pull(root: Path, target: Target, catalog: Catalog, outcome: Outcome, tell: Tell, *, dry_run: bool) -> None:
    versions = Versions(root)
    local, _ = local_items(root)
    here = compare(local, catalog, tell)
    for item in catalog.items:
        if here.held.get(item.key) == item.content:
            versions.add(item.key, [*item.after, item.content])
    wanted = with_needed_columns(root, target, choose(catalog, here, root, versions, outcome), outcome)
    if dry_run:
        for each in wanted:
            outcome.done.append(_done(each))
            outcome.moved_bytes += each.bytes
        return
    _remove_staging(root, keep={each.item.content for each in wanted})
    _check_room(root, wanted)
    for each in wanted:
        if each.item.key in here.taken and each.name == each.item.name:
            versions.begin(each.item.key, [*each.item.after, each.item.content])
        if each.item.kind == "recording":
            versions.add_pulled(each.name)
    save_versions(versions, outcome)  # before: a pull that is killed has then forgotten nothing
    try:
        unread = _bring_all(root, target, wanted, versions, outcome, tell)
        _remove_staging(root, keep=unread)
    except (TargetError, StorageFullError) as error:
        outcome.stopped = LeftOut.of(error)
    finally:
        save_versions(versions, outcome)


@contextmanager
def _own(root: Path) -> Iterator[None]:
    """The data directory, made where there is none, without a server in it."""
    try:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        what = f"The data directory cannot be made: {error.strerror}."
        raise DataDirError(what, where=str(root), advice="Name another one with --data-dir.") from error
    with locked(root):
        yield


def _bring_all(
    root: Path, target: Target, wanted: list[Wanted], versions: Versions, outcome: Outcome, tell: Tell
) -> set[str]:
    """Contents that the target did not give whole: what came of them is kept, and the next pull goes on there."""
    unread = set[str]()
    total = max(1, sum(each.bytes for each in wanted))
    come = 0

    def on_chunk(size: int, moved: bool) -> None:
        nonlocal come
        come += size
        outcome.moved_bytes += size if moved else 0
        tell(STEP, min(1.0, come / total))

    for each in wanted:
        staging = root / STAGING / each.item.content
        try:
            with storage_errors(staging):
                _bring(root, staging, target, each, on_chunk)
        except StorageFullError:
            raise
        except (DamagedError, StorageError) as error:
            shutil.rmtree(staging, ignore_errors=True)
            outcome.left_out.append(LeftOut(error.what, f"{WORDS[each.item.kind]} {each.item.title}", error.advice))
        except TargetError as error:
            if not target.sizes(ITEMS):  # the whole target has gone
                raise
            unread.add(each.item.content)
            outcome.left_out.append(LeftOut.of(error, f"{WORDS[each.item.kind]} {each.item.title}"))
        else:
            outcome.done.append(_done(each))
            if each.name == each.item.name:
                versions.add(each.item.key, [*each.item.after, each.item.content])
    return unread


def _bring(root: Path, staging: Path, target: Target, wanted: Wanted, on_chunk: OnChunk) -> None:
    """Raises DamagedError, StorageError, TargetError."""
    item, shelf = wanted.item, root / FOLDERS[wanted.item.kind]
    place = shelf / wanted.name
    adding = item.kind != "recording" and place.is_dir()
    staging.mkdir(mode=0o700, parents=True, exist_ok=True)
    shelf.mkdir(mode=0o700, exist_ok=True)
    for entry in wanted.files:
        fetch_file(target, entry, staging / entry.name, on_chunk)
    if item.kind == "recording":
        prove(item, staging)
        _give_name(staging / item.files[0].name, place)
    elif adding:
        for entry in wanted.files:
            _give_name(staging / entry.name, place / entry.name)
    else:
        prove(item, staging)
        _give_folder_name(staging, place)
    shutil.rmtree(staging, ignore_errors=True)


def _give_name(staged: Path, place: Path) -> None:
    """Fails where there is such a file: a recorder may have made one meanwhile."""
    try:
        os.link(staged, place)
        staged.unlink()
    except OSError as error:
        if error.errno == errno.EXDEV:
            with _beside(place) as aside:
                _copy_durably(staged, aside)
                _give_name(aside, place)
            return
        if error.errno not in _NO_LINKS:
            raise
        if place.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(place)) from None
        os.rename(staged, place)
    sync_directory(place.parent)


def _give_folder_name(staged: Path, place: Path) -> None:
    """Fails where there is such a folder with something in it."""
    try:
        os.rename(staged, place)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        with _beside(place) as aside:
            aside.mkdir(mode=0o700)
            for path in staged.iterdir():
                _copy_durably(path, aside / path.name)
            sync_directory(aside)
            os.rename(aside, place)
    sync_directory(place.parent)


@contextmanager
def _beside(place: Path) -> Iterator[Path]:
    """A name on the disk where a linked folder of the library leads; what is still there at the end is removed."""
    aside = place.with_name(f"{TEMPORARY}{place.name}-{new_id()}")
    try:
        yield aside
    finally:
        if aside.is_dir():
            shutil.rmtree(aside, ignore_errors=True)
        else:
            aside.unlink(missing_ok=True)


def _copy_durably(source: Path, to: Path) -> None:
    with source.open("rb") as read, open(to, "xb", opener=_private) as file:
        shutil.copyfileobj(read, file, _COPY_BYTES)
        file.flush()
        os.fsync(file.fileno())


def _private(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_CLOEXEC, 0o600)


def _check_room(root: Path, wanted: list[Wanted]) -> None:
    """Raises StorageFullError."""
    staged = sum(path.lstat().st_size for path in (root / STAGING).rglob("*") if path.is_file())
    need = max(0, sum(each.bytes for each in wanted) - staged)
    free = shutil.disk_usage(root).free
    if wanted and need + SPARE_BYTES > free:
        what = f"{need / 1e6:.1f} MB are to come, and {free / 1e6:.1f} MB are free."
        raise StorageFullError(what, where=str(root), advice="Free some space and try again: nothing was brought.")


def _remove_staging(root: Path, keep: Collection[str] = ()) -> None:
    staging = root / STAGING
    if staging.is_dir():
        for folder in staging.iterdir():
            if folder.name not in keep:
                shutil.rmtree(folder, ignore_errors=True)
        if not keep:
            with suppress(OSError):  # something else lies there
                staging.rmdir()


def _done(wanted: Wanted) -> Done:
    return Done(wanted.item.kind, wanted.name, wanted.item.title, wanted.bytes)
