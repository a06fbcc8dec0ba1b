"""``hedgehop library push|pull|list``: exit code 0 when all of it is done, 1 when something was left out or stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from server.cli.library.sharing_words import Telling, listed, outcome_lines
from server.cli.shared import options as o
from server.cli.shared.command import DONE, FAILED, command
from server.cli.shared.output import answer, end_progress, harmless, say
from server.errors import TargetError
from server.library.sharing.catalog import read_catalog
from server.library.sharing.outcome import LeftOut, Outcome
from server.library.sharing.pull import pull as pull_library
from server.library.sharing.push import push as push_library
from server.library.sharing.sharing_targets import Target, open_target
from server.settings import load_settings

TargetPlace = Annotated[
    str, Argument(metavar="TARGET", help="A folder of any disk, or a URL: s3://bucket/prefix (hedgehop[store]).")
]
DataDir = Annotated[Path | None, Option(help="This machine's library; default: the user's data home.")]
DryRun = Annotated[bool, Option("--dry-run", help="Say what would be done, and do nothing.")]


@command
def push(
    target: TargetPlace,
    *,
    check: Annotated[bool, Option("--check", help="Read again what is there, and send anew what is damaged.")] = False,
    dry_run: DryRun = False,
    data_dir: DataDir = None,
    as_json: o.AsJson = False,
) -> None:
    """Send what the target lacks of this library: recordings, plans, models, photos, radar files; never a secret."""
    root, place = load_settings(data_dir=data_dir).data_dir, open_target(target)
    words = ("Would send", "already there") if dry_run else ("Sent", "already there")
    with _told(place, words, as_json) as (outcome, tell):
        push_library(root, place, outcome, tell, dry_run=dry_run, check=check)


@command
def pull(target: TargetPlace, *, dry_run: DryRun = False, data_dir: DataDir = None, as_json: o.AsJson = False) -> None:
    """Bring what this library lacks of the target's; nothing here is replaced. Hedgehop must not be running."""
    root, place = load_settings(data_dir=data_dir).data_dir, open_target(target)
    words = ("Would bring", "already here") if dry_run else ("Brought", "already here")
    with _told(place, words, as_json) as (outcome, tell):
        pull_library(root, place, outcome, tell, dry_run=dry_run)


@command
def list_(target: TargetPlace, *, as_json: o.AsJson = False) -> None:
    """Say what a target holds."""
    place = open_target(target)
    catalog = read_catalog(place, Telling().tell)
    end_progress()
    if not catalog.item_sizes:
        what = "No library was pushed here."
        raise TargetError(what, where=place.text, advice="Check the target, or push to it first.")
    entries = listed(catalog)
    lines = [harmless(entry.words()) for entry in entries]
    for fault in catalog.faults:
        say(f"Left out: {fault.words()}")
    summary = {
        "target": place.text,
        "items": [entry.to_json() for entry in entries],
        "left_out": [fault.to_json() for fault in catalog.faults],
    }
    answer(summary, lines, as_json=as_json)
    whole = not catalog.faults and all(entry.missing_blobs == 0 for entry in entries)
    raise typer.Exit(DONE if whole else FAILED)


@contextmanager
def _told(
    target: Target, words: tuple[str, str], as_json: bool
) -> Iterator[tuple[Outcome, Callable[[str, float], None]]]:
    """Says what came of it, also when Ctrl-C ended it; the command ends here."""
    outcome = Outcome()
    try:
        yield outcome, Telling().tell
    except KeyboardInterrupt:
        outcome.stopped = LeftOut("Stopped by Ctrl-C.", target.text, "Run the command again: it goes on.")
    end_progress()
    for left_out in outcome.left_out:
        say(f"Left out: {left_out.words()}")
    if outcome.stopped is not None:
        say(f"Stopped: {outcome.stopped.words()}")
    answer({"target": target.text, **outcome.to_json()}, outcome_lines(outcome, *words), as_json=as_json)
    raise typer.Exit(DONE if outcome.whole else FAILED)
