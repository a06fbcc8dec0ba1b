"""This library to a target: blobs first, then the item that names them, so that what breaks off leaves it whole."""

from __future__ import annotations

from pathlib import Path

from server.errors import DamagedError, DataDirError, StorageError, TargetError
from server.library.sharing.catalog import UNCHANGING, VERSIONED, Catalog, damage_of, read_catalog
from server.library.sharing.local_items import LocalItem, item_of, local_items
from server.library.sharing.outcome import Done, LeftOut, Outcome, Tell
from server.library.sharing.proving import prove_own
from server.library.sharing.reading_ahead import Behind
from server.library.sharing.shared_items import WORDS, Item, differ, digest_of
from server.library.sharing.sharing_targets import DAMAGED, FOLDER, ITEMS, FolderTarget, Target, blob_path, item_path
from server.library.sharing.versions import Versions

STEP = "Sending"


def push(
    root: Path, target: Target, outcome: Outcome, tell: Tell, *, dry_run: bool = False, check: bool = False
) -> None:
    """Fills ``outcome`` as it goes. ``check``: what is there is read again, and sent anew where it is damaged.

    May run beside a server: what is written meanwhile is left out and said. Raises DataDirError, TargetError where
    nothing could be begun; a target that fails later stops it.
    """
    if not root.is_dir():
        raise DataDirError("There is no such data directory.", where=str(root), advice="Name it with --data-dir.")
    check_apart(root, target)
    catalog = read_catalog(target, tell)
    outcome.left_out += catalog.faults
    if not dry_run:
        _set_aside(target, catalog, outcome)
    versions = Versions(root)
    items, left_out = local_items(root)
    outcome.left_out += left_out
    try:
        with Behind(target.threads) as writing:
            if isinstance(target, FolderTarget) and not dry_run:
                target.tidy()
            _Push(target, catalog, versions, outcome, writing, dry_run, check).all(items, tell)
    except TargetError as error:
        outcome.stopped = LeftOut.of(error)
    finally:
        if not dry_run:
            save_versions(versions, outcome)


def check_apart(root: Path, target: Target) -> None:
    """Raises TargetError for a folder inside the data directory."""
    if isinstance(target, FolderTarget) and target.folder.resolve().is_relative_to(root.resolve()):
        what = "The target lies in the data directory itself."
        raise TargetError(what, where=target.text, advice="Choose a folder of another disk.")


class _Push:
    def __init__(
        self,
        target: Target,
        catalog: Catalog,
        versions: Versions,
        outcome: Outcome,
        writing: Behind,
        dry_run: bool,
        check: bool,
    ) -> None:
        self._target, self._catalog, self._versions, self._outcome = target, catalog, versions, outcome
        self._writing, self._dry_run, self._check = writing, dry_run, check
        self._contents, self._by_key = catalog.contents(), catalog.by_key()
        self._checked: set[str] = set()

    def all(self, items: list[LocalItem], tell: Tell) -> None:
        """Raises TargetError."""
        total = max(1, sum(_bytes(item) for item in items))
        read_bytes = 0
        for local in items:
            sent = 0

            def on_chunk(chunk: bytes, digest: str) -> None:
                nonlocal read_bytes, sent
                sent += self._send(chunk, digest)
                read_bytes += len(chunk)
                tell(STEP, min(1.0, read_bytes / total))

            try:
                if local.kind != "recording":
                    prove_own(local)
                self._finish(item_of(local, self._after(local), on_chunk), sent)
            except (StorageError, DamagedError) as error:
                self._outcome.left_out.append(LeftOut.of(error, local.place))

    def _after(self, local: LocalItem) -> tuple[str, ...]:
        key = f"{local.kind}/{local.name}"
        return self._versions.had(key) if local.kind in VERSIONED else ()

    def _send(self, chunk: bytes, digest: str) -> int:
        """How many bytes went over the line."""
        if self._catalog.has(digest, len(chunk)) and not (self._check and self._is_damaged(digest, len(chunk))):
            return 0
        self._catalog.blob_sizes[digest] = len(chunk)
        self._checked.add(digest)
        if not self._dry_run:
            self._writing.call(self._target.write, blob_path(digest), chunk)
        self._outcome.moved_bytes += len(chunk)
        return len(chunk)

    def _is_damaged(self, digest: str, size: int) -> bool:
        if digest in self._checked:
            return False
        self._checked.add(digest)
        try:
            return digest_of(self._target.read(blob_path(digest), size)) != digest
        except TargetError:  # a bad sector; where the whole target has gone, writing it anew says so
            return True

    def _finish(self, read: Item, sent: int) -> None:
        """The item itself, once all that it names is on the target's disk."""
        self._writing.finish()
        item = read.model_copy(update={"after": tuple(content for content in read.after if content != read.content)})
        if item.kind in UNCHANGING and any(
            differ(other.files, {entry.name: entry for entry in item.files}) for other in self._by_key[item.key]
        ):
            what = f"The {WORDS[item.kind]} in the target has the same id and other content: one of the two is damaged."
            raise StorageError(
                what, where=item.name, advice="Look at both, and delete the damaged one here, or begin anew."
            )
        if item.content in self._contents:
            if sent == 0:
                self._outcome.there += 1
            else:
                self._outcome.done.append(Done(item.kind, item.name, item.title, item.bytes))
            self._settle()
        else:
            self._write(item)
        self._versions.add(item.key, [item.content])

    def _write(self, item: Item) -> None:
        data = item.to_bytes()
        if not self._dry_run:
            self._settle()
            self._target.write(item_path(f"{digest_of(data)}.json"), data)
            self._settle()
        self._contents.add(item.content)
        self._outcome.done.append(Done(item.kind, item.name, item.title, item.bytes))

    def _settle(self) -> None:
        if not self._dry_run:
            self._target.settle()


def _set_aside(target: Target, catalog: Catalog, outcome: Outcome) -> None:
    """Once what it stood for has changed nobody writes an item of that name again. Raises TargetError."""
    for name in catalog.damaged:
        if target.set_aside(name):
            said = outcome.left_out.index(damage_of(name))
            what = f"The item was damaged, and is set aside in {FOLDER}/{DAMAGED}."
            advice = "A push from where it came from sends it anew."
            outcome.left_out[said] = LeftOut(what, f"{ITEMS}/{name[:80]}", advice)
    if catalog.damaged:
        target.settle()


def _bytes(local: LocalItem) -> int:
    try:
        return sum(local.sizes().values())
    except StorageError:  # gone since; said when its turn comes
        return 0


def save_versions(versions: Versions, outcome: Outcome) -> None:
    """What was sent is sent all the same."""
    try:
        versions.save()
    except StorageError as error:
        outcome.left_out.append(LeftOut.of(error))
