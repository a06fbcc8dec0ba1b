"""Uploads and commands over a bad link, on a virtual clock, with vehicles that speak as ArduCopter and as PX4 do."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from telemetry.errors import RefusedError, SilentError
from telemetry.mavlink.actions import Done, Failed
from telemetry.mavlink.codec import Parser
from telemetry.mavlink.items import item_from_message
from telemetry.mavlink.verify import as_stored, digest
from telemetry.topics.onboard_lists import UploadReport
from tests.telemetry.frames import attitude, packed
from tests.telemetry.lossy import Faults
from tests.telemetry.mission_samples import HARSH, VEHICLES, WORSE, mission, upload
from tests.telemetry.mission_vehicles import ArduCopter
from tests.telemetry.test_commands import ARM, LOSSY, Craft, command, give, is_armed
from tests.trust.rows import Row, judged

ITEMS, MOST_S = 100, 60.0
BY = "make trust"


def link_rows(*, uploads: int, cuts: int, commands: int, frames: int) -> Iterator[Row]:
    """``uploads``, ``cuts``: for each of the two kinds of vehicle."""
    for vehicle in VEHICLES:
        yield _lossy(vehicle, uploads)
    yield _half_lost(uploads)
    yield _cut(cuts)
    yield _last_acknowledgement(uploads)
    yield _commands(commands)
    yield _noise(frames)


def _verified(run: Any, items: tuple[Any, ...]) -> bool:
    """Told so, and so it is: what the vehicle holds was compared here."""
    told = isinstance(run.end, Done) and isinstance(run.end.result, UploadReport) and run.end.result.verified
    return told and _holds(run.vehicle, items)


def _holds(craft: Any, items: tuple[Any, ...]) -> bool:
    is_ardupilot = isinstance(craft, ArduCopter)
    rows = craft.stored[1:] if is_ardupilot else craft.stored
    wanted = digest(as_stored(items, "ardupilot" if is_ardupilot else "px4"))
    return digest(tuple(item_from_message(row) for row in rows)) == wanted


def _lossy(vehicle: type, uploads: int) -> Row:
    took, done = [], 0
    for seed in range(uploads):
        items = mission(ITEMS, seed=seed)
        run = upload(items, vehicle(), HARSH, seed=seed)
        done += _verified(run, items)
        took.append(run.now_s)
    figure = f"{vehicle.__name__}: {done} of {uploads} uploads of {ITEMS} items verified, slowest {max(took):.0f} s"
    promise = "30 % of the frames lost both ways, more of them late, twice or spoilt: uploaded within 60 s, read back"
    return Row("R1", promise, judged(done == uploads and max(took) <= MOST_S), figure, BY)


def _half_lost(uploads: int) -> Row:
    done = 0
    for vehicle in VEHICLES:
        for seed in range(uploads):
            items = mission(50, seed=seed)
            done += _verified(upload(items, vehicle(), WORSE, seed=seed), items)
    runs = len(VEHICLES) * uploads
    return Row(
        "R1", "50 % lost: 49 of 50 uploads succeed", judged(done >= 0.98 * runs), f"{done} of {runs} verified", BY
    )


def _cut(cuts: int) -> Row:
    false = verified = 0
    rng = random.Random(7)
    items, before = mission(8), mission(6, seed=9)
    for vehicle in VEHICLES:
        whole = upload(items, _loaded(vehicle, before)).sent
        for _ in range(cuts):
            at, way = rng.randrange(whole - 1), rng.choice(("up", "down", "both"))

            def lost(direction: str, _: Any, number: int, at: int = at, way: str = way) -> bool:
                return number >= at and way in (direction, "both")

            faults = Faults(loss=rng.choice((0.0, 0.2)))
            run = upload(items, _loaded(vehicle, before), faults, seed=rng.randrange(10**6), lose=lost)
            verified += isinstance(run.end, Done)
            false += isinstance(run.end, Done) and not _verified(run, items)
    runs = len(VEHICLES) * cuts
    figure = f"{false} false successes in {runs} cuts; {runs - verified} failed by name, {verified} were whole by then"
    return Row("R2", "The link dies at any message of an upload: never a false success", judged(false == 0), figure, BY)


def _loaded(vehicle: type, items: tuple[Any, ...]) -> Any:
    craft = vehicle()
    upload(items, craft)
    return craft


def _last_acknowledgement(uploads: int) -> Row:
    def lost(direction: str, message: Any, _: int) -> bool:
        return direction == "down" and message.get_type() == "MISSION_ACK" and message.type == 0

    done = 0
    for vehicle in VEHICLES:
        for seed in range(uploads):
            items = mission(10 + seed)
            done += _verified(upload(items, vehicle(), Faults(loss=0.05), seed=seed, lose=lost), items)
    runs = len(VEHICLES) * uploads
    figure = f"{done} of {runs} settled by reading back"
    return Row("R3", "The last acknowledgement never comes: settled by reading back", judged(done == runs), figure, BY)


def _commands(commands: int) -> Row:
    twice = unanswered = 0
    for seed in range(commands):
        # Repetitions by the link itself are left out: no vehicle can tell them from ours.
        craft, faults = Craft(), replace(LOSSY, duplicates=0.0)
        run = give(command(ARM, 1), craft, faults, once=True, confirm=is_armed, seed=seed)
        twice += craft.executed > 1
        named = isinstance(run.end, Failed) and isinstance(run.error, SilentError | RefusedError)
        unanswered += not (isinstance(run.end, Done) or named)
    figure = f"{commands - unanswered} of {commands} answered or named, {twice} carried out twice"
    promise = "Arming at 30 % loss: an answer or a named failure, never done twice"
    return Row("R6", promise, judged(twice == unanswered == 0), figure, BY)


def _noise(frames: int) -> Row:
    """Genuine messages among random bytes, spoilt copies of themselves and invented ids, one datagram each."""
    rng, parser, kept = random.Random(1), Parser(datagrams=True), 0
    genuine = packed(attitude(0))
    every = 10
    for number in range(frames):
        junk = bytearray(genuine)
        if number % 3 == 0:
            junk[rng.randrange(len(junk))] ^= 1 << rng.randrange(8)
        elif number % 3 == 1:
            junk[7:10] = rng.randbytes(3)
        else:
            junk = bytearray(rng.randbytes(rng.randrange(1, 60)))
        parser.feed(bytes(junk))
        if number % every == 0:
            kept += len(parser.feed(packed(attitude(number))))
    wanted = len(range(0, frames, every))
    figure = f"{kept} of {wanted} genuine messages kept among {frames} hostile datagrams, no exception"
    return Row("R7", "Stray, spoilt and invented packets cost no genuine message", judged(kept == wanted), figure, BY)
