"""The surface model below the vehicle is the one on show, also after another one was opened."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from planning.ground.demo_hillside import small_hill
from server.flying.plan_followed import PlanFollowed
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.library import Library
from tests.server.fakes import Told


def test_another_surface_model_is_taken_up_and_the_same_one_is_not_made_again(tmp_path: Path) -> None:
    workspace: Any = SimpleNamespace(dsm=small_hill())

    async def scenario() -> None:
        library = Library(tmp_path)
        channel = Channel("live", Told())
        followed = PlanFollowed(library, channel, Aboard(tmp_path / "onboard.json"), workspace)
        work = asyncio.create_task(followed.run())
        try:
            for dsm in (small_hill(), small_hill()):
                before = channel.follower
                workspace.dsm = dsm
                followed.look()
                async with asyncio.timeout(60):
                    while channel.follower is before:
                        await asyncio.sleep(0.01)
                made = channel.follower
                followed.look()
                await asyncio.sleep(0.05)
                assert channel.follower is made
            assert not work.done()
        finally:
            work.cancel()
            await asyncio.wait([work])
            library.close()

    asyncio.run(scenario())
