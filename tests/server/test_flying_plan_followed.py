"""The surface model below the vehicle is the one on show, also after another one was opened."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from planning.ground.demo_hillside import small_hill
from planning.terrain.dsm import Dsm
from server.flying.plan_followed import PlanFollowed
from server.heard.channel import Channel
from server.library import Library


def test_another_surface_model_is_taken_up_and_the_same_one_is_not_made_again(tmp_path: Path) -> None:
    told: list[Any] = []
    shown: list[Dsm] = [small_hill()]

    async def scenario() -> None:
        library = Library(tmp_path)
        channel = Channel("live", told.append)
        followed = PlanFollowed(library, channel, open_dsm=lambda: shown[-1])
        work = asyncio.create_task(followed.run())
        try:
            for dsm in (small_hill(), small_hill()):
                before = channel.follower
                shown.append(dsm)
                followed.want(None)
                async with asyncio.timeout(60):
                    while channel.follower is before:
                        await asyncio.sleep(0.01)
                made = channel.follower
                followed.want(None)
                await asyncio.sleep(0.05)
                assert channel.follower is made
            assert not work.done()
        finally:
            work.cancel()
            await asyncio.wait([work])
            library.close()

    asyncio.run(scenario())
