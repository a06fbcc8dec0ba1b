"""The fencing token against a stranger on the bus: what it sends is refused or topped, Return is never shut out."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest

from server.door.lease import Lease
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, NoVehicleError, OvertakenError
from telemetry.topics.requests import (
    Connect,
    HighestToken,
    Land,
    Operator,
    Pause,
    Release,
    ReturnHome,
    highest_possible_token,
)
from tests.free_ports import free_port
from tests.telemetry.bus_runs import run
from tests.telemetry.link_bench import until
from tests.telemetry.test_link_node import Node, station

ANNA, BEN = "a" * 64, "b" * 64
IMPOSSIBLE = (2**61, 2**63 - 1, -1)


async def can_command(client: LinkClient, lease: Lease) -> None:
    """No vehicle is there: a request that gets so far has passed the check of its token."""
    for command in (Pause, ReturnHome, Land):
        with pytest.raises(NoVehicleError):
            await client.call(command(lease.operator(ANNA)))


async def started(node: Node, client: LinkClient, lease: Lease, *arguments: str) -> None:
    node.start(*arguments)
    await client.call(Connect(lease.operator(ANNA), f"udpin:127.0.0.1:{free_port()}"))


def test_no_token_of_a_stranger_shuts_the_operator_out(tmp_path: Path) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.press(ANNA, "Anna")

    async def whole() -> None:
        async with station(tmp_path, issue_above=lease.issue_above) as (node, client):
            await started(node, client, lease)
            for token in IMPOSSIBLE:
                with pytest.raises(NotAllowedError):
                    await client.call(Release(Operator("stranger", token)))
                await can_command(client, lease)
            for before_s in (0.0, 1.0, 0.001, 0.0):
                await client.call(Release(Operator("stranger", highest_possible_token(time.time() - before_s))))
                await can_command(client, lease)
            anna = lease.operator(ANNA)
            assert await client.call(HighestToken()) == anna.token
            lease.press(BEN, "Ben")
            lease.hand_over(ANNA)
            with pytest.raises(NoVehicleError):
                await client.call(ReturnHome(lease.operator(BEN)))
            with pytest.raises(OvertakenError, match="taken over by Ben"):
                await client.call(ReturnHome(anna))

    run(whole)


@pytest.mark.parametrize("highest", [2**61, 10**30])
def test_what_an_earlier_version_has_kept_heals(tmp_path: Path, highest: int) -> None:
    lease = Lease(tmp_path / "lease.json")
    lease.press(ANNA, "Anna")

    async def whole() -> None:
        async with station(tmp_path, issue_above=lease.issue_above) as (node, client):
            kept = node.runtime / "link.json"
            kept.write_text(json.dumps({"highest_token": highest}))
            await started(node, client, lease)
            await can_command(client, lease)

            def written() -> Any:
                return json.loads(kept.read_text())["highest_token"]

            await until(lambda: written() == lease.operator(ANNA).token)

    run(whole)
