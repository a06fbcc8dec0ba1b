"""What must hold of a flight with faults; each thing that did not is one sentence."""

from __future__ import annotations

import math
from collections.abc import Iterator

from telemetry.bus.liveness import HUNG_S
from tests.soak.faults import Done
from tests.soak.flight import BACK_S, Flown

LATE_S = 1.5
"""A page reads what was said before a fault a little after it."""
LINK_LOST_S = HUNG_S + LATE_S
JUST_BACK_S = 0.3
"""What the next one says may be told sooner than that it runs, and both sooner than it is seen here."""


def broken(flown: Flown) -> list[str]:
    return [
        *_contacts(flown),
        *(sentence for done in flown.done for sentence in (*_untold(flown, done), *_wrong_words(flown, done))),
        *_afterwards(flown),
        *_recordings(flown),
    ]


def contacts(flown: Flown) -> set[str]:
    """The simulated vehicle's own words about what it flew into, as pages and recordings have them."""
    live = (told.message["text"]["text"] for told in flown.page.since(0.0, "text"))
    kept = (text.text for log in flown.logs for text in log.texts)
    return {text for text in (*live, *kept) if text.startswith("Crash")}


def _contacts(flown: Flown) -> Iterator[str]:
    for text in sorted(contacts(flown)):
        yield f'Contact: "{text}".'


def _untold(flown: Flown, done: Done) -> Iterator[str]:
    """One that ended, or was away for longer than it may be, has to be named, and to be back."""
    fault, page = done.fault, flown.page
    if fault.how in ("pause", "starve"):
        return
    until_s = done.at_s + BACK_S
    if fault.who == "server":
        told = page.since(done.at_s, "alarms", until_s)
        codes = {alarm["error"]["code"] for each in told for alarm in each.message["alarms"]}
        if "server_restarted" not in codes:
            yield f"{fault}: no page was told of the server's restart within {BACK_S:.0f} s."
        return
    # A spare one may run again before a page is told of anything between.
    before = max(_restarts(flown, done), default=0)
    states = [
        "restarting" if node["restarts"] > before else node["state"]
        for told in page.since(done.at_s, "nodes", until_s)
        for node in told.message["nodes"]
        if node["name"] == fault.who
    ]
    if not {"silent", "restarting", "starting"} & set(states):
        yield f"{fault}: no page was told that the {fault.who} node does not work."
    if done.back_s > until_s:
        yield f"{fault}: the {fault.who} node did not work again within {BACK_S:.0f} s."
    if fault.who == "link" and fault.how == "stop" and not _lost_was_told(flown, done):
        yield f"{fault}: no page was told that avoidance is lost."


def _restarts(flown: Flown, done: Done) -> Iterator[int]:
    """Of the node, as pages were told before the fault."""
    for told in flown.page.since(0.0, "nodes", done.at_s):
        yield from (node["restarts"] for node in told.message["nodes"] if node["name"] == done.fault.who)


def _lost_was_told(flown: Flown, done: Done) -> bool:
    told = flown.page.since(done.at_s, "obstacles", done.back_s + LATE_S)
    return any(each.message["obstacles"]["avoidance"]["state"] == "lost" for each in told)


def _wrong_words(flown: Flown, done: Done) -> Iterator[str]:
    """Of a link that is stopped nothing may be shown as known, from the promised time on until it is ended."""
    fault, page = done.fault, flown.page
    if fault.who != "link" or fault.how not in ("stop", "kill"):
        return
    until_s = min(done.back_s, _told_back_s(flown, done)) - JUST_BACK_S
    avoidance = [
        (told.t_mono_s, told.message["obstacles"]["avoidance"]["state"])
        for told in page.since(done.at_s, "obstacles", until_s)
        if told.message["source"] == "live"
    ]
    links = [(told.t_mono_s, told.message["link"]["state"]) for told in page.since(done.at_s, "link", until_s)]
    for what, known, told in (("avoidance", "watching", avoidance), ("the link", "live", links)):
        # Once it was said to be lost, and from the promised time on at the latest, until the next link is there.
        from_s = min([done.at_s + LINK_LOST_S, *(t_s for t_s, state in told if state == "lost")])
        late = [t_s for t_s, state in told if state == known and t_s >= from_s]
        if late:
            yield f'{fault}: {what} was "{known}" {late[-1] - done.at_s:.1f} s after it.'


def _told_back_s(flown: Flown, done: Done) -> float:
    """When a page was told that the node runs again."""
    was_told_of = False
    for told in flown.page.since(done.at_s, "nodes"):
        state = next((n["state"] for n in told.message["nodes"] if n["name"] == done.fault.who), "running")
        if was_told_of and state == "running":
            return told.t_mono_s
        was_told_of |= state != "running"
    return math.inf


def _afterwards(flown: Flown) -> Iterator[str]:
    onboard = [told.message["fly"]["onboard"] for told in flown.page.since(0.0, "fly")]
    if not onboard or onboard[-1]["digest"] != flown.digest:
        yield "The mission on board is not known any more to be the one that was started."
    leases = [told.message["lease"] for told in flown.page.since(0.0, "lease")]
    if not leases or not leases[-1]["mine"]:
        yield "The operator is not in charge any more."
    if not any(flown.page.since(flown.ended_s - 5.0, "vehicle")):
        yield "At the end no page was told of the vehicle for 5 s."


def _recordings(flown: Flown) -> Iterator[str]:
    if len(flown.logs) != 1:
        yield f"{len(flown.logs)} recordings of one flight."
        return
    (log,) = flown.logs
    killed = sum(done.fault.who == "recorder" and done.fault.how in ("kill", "stop") for done in flown.done)
    gaps = sum("Nothing was recorded" in fault for fault in log.faults)
    if gaps < killed:
        yield f"The recorder died {killed} times, and its recording tells of {gaps} gaps."
    # It is read while the flight goes on.
    others = [fault for fault in log.faults if "recorder had died" not in fault and "not finished" not in fault]
    if others:
        yield f"The recording has faults: {' '.join(others)}"
