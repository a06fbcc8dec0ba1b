"""The heartbeat, and when it must fall silent."""

import asyncio

from telemetry.link.heartbeat import HOLD_S, PERIOD_S, Grace, Heartbeat

GRACE_S = 10.0


def beats(grace: Grace, age_s: float | None, now_s: float, *, guided: bool = False) -> bool:
    return grace.may_beat(age_s, guided=guided, now_s=now_s)


def holds(grace: Grace, age_s: float | None, now_s: float, *, guided: bool = True) -> bool:
    return grace.wants_hold(age_s, guided=guided, now_s=now_s)


def test_in_auto_it_goes_on_for_the_grace_and_then_stops() -> None:
    grace = Grace(GRACE_S)
    assert beats(grace, 0.5, 0.0)
    assert beats(grace, 9.9, 9.0)
    assert not beats(grace, 10.1, 10.0)
    assert not holds(grace, 10.1, 10.0, guided=False)


def test_it_beats_again_when_the_server_is_back() -> None:
    grace = Grace(GRACE_S)
    assert not beats(grace, 60.0, 60.0)
    assert beats(grace, 0.1, 61.0)


def test_where_no_server_is_expected_it_never_stops() -> None:
    assert beats(Grace(GRACE_S), None, 1e6)
    assert not holds(Grace(GRACE_S), None, 1e6)


def test_in_guided_a_hold_comes_first_and_only_once() -> None:
    grace = Grace(GRACE_S)
    assert not holds(grace, 9.9, 9.9)
    assert holds(grace, 10.1, 10.1)
    assert not holds(grace, 10.2, 10.2)
    assert beats(grace, 10.2, 10.2, guided=True)
    assert not beats(grace, 15.0, 10.1 + HOLD_S, guided=True)


def test_a_server_that_came_back_and_went_again_means_another_hold() -> None:
    grace = Grace(GRACE_S)
    assert holds(grace, 10.1, 10.1)
    assert not holds(grace, 0.1, 20.0)
    assert holds(grace, 10.1, 30.0)


def test_it_beats_at_once_when_a_way_opens_and_once_a_second_from_then_on() -> None:
    async def whole() -> None:
        beats_s: list[float] = []
        loop = asyncio.get_running_loop()
        heart = Heartbeat(lambda _: beats_s.append(loop.time()) is None, lambda: True)
        task = asyncio.create_task(heart.run())
        while not beats_s:
            await asyncio.sleep(0)
        heart.beat_now()
        while len(beats_s) < 2:
            await asyncio.sleep(0)
        while len(beats_s) < 3:
            await asyncio.sleep(0.01)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        assert beats_s[1] - beats_s[0] < PERIOD_S / 2
        assert beats_s[2] - beats_s[1] >= PERIOD_S - 0.01

    asyncio.run(whole())


def test_only_beats_that_were_sent_are_counted() -> None:
    class Wire:
        def __init__(self) -> None:
            self.sent: list[object] = []
            self.open = True

        def send(self, message: object) -> bool:
            self.sent.append(message)
            return self.open

    async def whole() -> float:
        wire = Wire()
        wire.open = False
        heart = Heartbeat(wire.send, lambda: True)
        task = asyncio.create_task(heart.run())
        while not wire.sent:
            await asyncio.sleep(0.01)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return heart.hz(asyncio.get_running_loop().time())

    assert asyncio.run(whole()) == 0.0
