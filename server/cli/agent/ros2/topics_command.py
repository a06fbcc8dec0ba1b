"""``hedgehop ros2 topics``: what a robot publishes, of which type, and whether it can be read."""

from __future__ import annotations

import time
from typing import Annotated, Any

from typer import Option

from server.cli.shared import options as o
from server.cli.shared.command import command
from server.cli.shared.output import answer, harmless
from server.cli.shared.ros2_options import Ros2Reach
from server.errors import BadRequestError
from telemetry.recording.ros.ros2_messages import Ros2Messages
from telemetry.ros2.grammar import NO_HASH, all_tokens
from telemetry.ros2.graph import Graph, TopicFound
from telemetry.ros2.listener import READ_TYPES
from telemetry.ros2.wire import Ros2Wire

REACH = Ros2Reach()


@command
def topics(
    reach: Ros2Reach = REACH,
    seconds: Annotated[float, Option(help="How long to listen for who is there.")] = 1.0,
    as_json: o.AsJson = False,
) -> None:
    """List the topics of a running robot with their types, and who publishes them."""
    address = reach.address()
    if not 0.1 <= seconds <= 60.0:
        raise BadRequestError(f"{seconds:g} s cannot be.", where="--seconds", advice="Give 0.1 to 60.")
    graph, messages = Graph(), Ros2Messages()
    with Ros2Wire.open(address, changed=lambda _: None) as wire:
        wire.watch_tokens(all_tokens(reach.domain), graph.on_token)
        time.sleep(seconds)
        found = graph.topics()
    rows = [_row(each, messages) for each in found]
    answer({"domain": reach.domain, "topics": rows}, _lines(rows, reach.domain, address.endpoint), as_json=as_json)


def _row(found: TopicFound, messages: Ros2Messages) -> dict[str, Any]:
    return {
        "topic": found.name,
        "type": found.type,
        "publishers": list(found.publishers),
        "subscriptions": found.subscriptions,
        "keeps_last": found.keeps,
        "hashes": list(found.hashes),
        "read": _how_read(found, messages),
    }


def _how_read(found: TopicFound, messages: Ros2Messages) -> str:
    """yes, unchecked (humble tells no hash), differs, or no."""
    if found.type not in READ_TYPES:
        return "no"
    other = set(found.hashes) - {NO_HASH, messages.hash_of(found.type)}
    return "differs" if other else "unchecked" if NO_HASH in found.hashes else "yes"


def _lines(rows: list[dict[str, Any]], domain: int, endpoint: str) -> list[str]:
    """What can be read first."""
    if not rows:
        return [f"Nobody publishes or subscribes in domain {domain} of {endpoint}. Is ROS_DOMAIN_ID another one?"]
    lines = [f"{len(rows)} topics in domain {domain} of {endpoint}"]
    words = {
        "yes": "",
        "unchecked": "  (definition unchecked)",
        "differs": "  (ANOTHER DEFINITION: not read)",
        "no": "",
    }
    for row in sorted(rows, key=lambda row: (row["read"] == "no", row["type"], row["topic"])):
        kept = ", keeps its last" if row["keeps_last"] else ""
        by = ", ".join(row["publishers"][:3]) or "nobody"
        head = f"{harmless(row['type']):36s} {harmless(row['topic']):30s} "
        lines.append(f"{head}by {harmless(by)}{kept}{words[row['read']]}")
    return lines
