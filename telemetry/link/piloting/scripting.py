"""The navigation script by which this link leads its vehicle from place to place: one at a time."""

from __future__ import annotations

import time
from typing import Any

from telemetry.errors import NotAllowedError
from telemetry.flight.guided.guided import GuidedScript
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.link.adopted import AdoptedVehicle
from telemetry.link.piloting.procedures import Accepted, Procedures, ReadParameters, guided_way
from telemetry.topics.messages import FlightStatus
from telemetry.topics.requests import FlyWay, SetSpeed, StartGuided

NOT_BEGUN = ("idle", "arming", "interrupted")
SUPERSEDED = "Another command was given."


class Scripting:
    def __init__(self, vehicle: AdoptedVehicle, procedures: Procedures, read_parameters: ReadParameters) -> None:
        self._vehicle, self._procedures, self._read_parameters = vehicle, procedures, read_parameters
        self._script: GuidedScript | None = None
        self._since_utc_s: float | None = None
        self.most_m_s: float | None = None
        """For which the way that was flown last is certified; None: it was a plan's."""

    @property
    def is_there(self) -> bool:
        """Also one that has just ended, until ``on_tick`` has told so."""
        return self._script is not None

    @property
    def flies(self) -> bool:
        return self._flown is not None

    @property
    def leads(self) -> bool:
        """It moves the vehicle, or is about to."""
        return self._flown is not None and self._flown.phase != "paused"

    @property
    def led(self) -> str:
        """How this link leads the vehicle; nothing where it does not. A way that is flown or paused holds."""
        if self.leads:
            return "being led along a way"
        return "being given a command" if self._procedures.is_under_way and not self.flies else ""

    @property
    def remaining(self) -> RemainingMission | None:
        """What is left of it, also while it is paused."""
        return None if self._flown is None else RemainingMission(self._flown.left, self._flown.end, "guided")

    @property
    def flies_on(self) -> bool:
        """On its way between places."""
        return self._flown is not None and self._flown.phase == "flying"

    @property
    def _flown(self) -> GuidedScript | None:
        return None if self._script is None or self._script.is_over else self._script

    def on_tick(self) -> FlightStatus | None:
        """Of the script that is flown or has just ended."""
        script = self._script
        if script is None:
            return None
        self._procedures.on_tick()
        if script.is_over:
            self._script = None
        return script.status(since_utc_s=self._since_utc_s)

    async def fly(self, request: StartGuided | FlyWay) -> None:
        """Ends what was under way."""
        vehicle, begun = self._vehicle, list[GuidedScript]()

        async def run(_: Accepted) -> None:
            way = await guided_way(vehicle.firmware, self._read_parameters)
            script = GuidedScript(
                request, vehicle.state, firmware=vehicle.firmware, target=vehicle.target, note=way.note, feed=way.feed
            )
            begun.append(script)
            self._script, self._since_utc_s = script, time.time()
            self.most_m_s = request.most_m_s if isinstance(request, FlyWay) else None
            try:
                await vehicle.exchanges.run(script)
            finally:
                script.stop(SUPERSEDED)

        await self._procedures.take_over(run, shows=lambda: any(script.phase not in NOT_BEGUN for script in begun))

    def set_speed(self, request: SetSpeed) -> None:
        """Raises NotAllowedError where it is more than the way is certified for."""
        script, most_m_s = self._flown, self.most_m_s
        if script is None or most_m_s is None:
            raise NotAllowedError("No guided way is being flown.", advice="Ask for one, with its speed.")
        if not 0.0 < request.speed_m_s <= most_m_s:
            what = f"{request.speed_m_s:g} m/s were asked for; the way is certified for at most {most_m_s:g} m/s."
            raise NotAllowedError(what, advice="Give a speed within that.")
        self._tell(script, script.set_speed(request.speed_m_s, time.monotonic()))

    def pause(self) -> bool:
        """Whether that is all that has to be done; not so while it takes off, and where none is flown."""
        script = self._flown
        if script is None:
            return False
        self._tell(script, script.pause(time.monotonic()))
        return script.is_over or script.phase == "paused"

    def check_resumes(self) -> None:
        """Raises NotAllowedError where nothing is left of it."""
        if self._flown is not None and self._flown.ends_held:
            raise NotAllowedError(self._flown.ends_held, advice="Ask for another way, or return.")
        if self._flown is not None and self._flown.is_flown:
            raise NotAllowedError("The way is flown: nothing is paused.", advice="Ask for another one, or return.")

    def resume(self) -> None:
        if (script := self._flown) is not None:
            self._tell(script, script.resume(time.monotonic()))

    def stop(self) -> None:
        """It sends nothing any more: another command has been given."""
        if self._flown is not None:
            self._flown.stop(SUPERSEDED)

    def drop(self) -> None:
        """Nothing more is told of it either."""
        self.stop()
        self._script = None

    def _tell(self, script: GuidedScript, actions: list[Any]) -> None:
        self._vehicle.exchanges.perform(script, actions)
