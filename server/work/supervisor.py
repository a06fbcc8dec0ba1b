"""Starts node processes, takes over those that outlived an earlier server, and starts the dead again."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from planning import __version__
from server.work.node_process import NodeProcess, SpareNode, bound_log
from telemetry import nodes
from telemetry.bus.liveness import HUNG_S, START_S, STARVED_S, Liveness, Silence
from telemetry.bus.node_lock import NodeFacts, running_node, running_nodes, silence_counts
from telemetry.bus.sockets import private_directory

log = logging.getLogger(__name__)

_PAUSES_S = (0.0, 0.2, 0.5, 1.0, 2.0, 5.0)
_STEADY_S = _PAUSES_S[-1]
"""A node that has run so long is started again at once: not more often than one that fails all the time."""
_LOOK_EVERY_S = 0.1
SPARED = frozenset({"link"})
"""Without it nothing avoids obstacles: beside one that runs steadily a spare one waits."""
LINK_HUNG_S = 1.5
"""It proves twice a second that it works, and a spare one is there at once: nothing avoids obstacles meanwhile."""
_TAKES_OVER_S, _SPARE_AGAIN_S = 2.0, 30.0
"""Until a spare one, which is loaded, has taken over, longer if it is still loading; until the next one is loaded after
one that failed."""


State = Literal["starting", "running", "silent", "restarting", "stopped"]
"""silent: it runs, but does not prove that it works; soon it is ended and started again."""


@dataclass(frozen=True, slots=True)
class NodeState:
    """One node, for people."""

    name: str
    state: State
    restarts: int = 0
    text: str = ""


@dataclass(frozen=True, slots=True)
class _Taken:
    """A spare one that was told to take over has proved nothing yet."""

    pid: int
    proved_t_mono_s: float


class _Node:
    """What is wanted of one node, and what there is."""

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        self.name = name
        self.arguments = tuple(arguments)
        self.state = NodeState(name, "starting")
        self.process: NodeProcess | None = None
        self.spare: SpareNode | None = None
        self.spare_again_s = 0.0
        self.keeping: asyncio.Task[None] | None = None
        self.failures = 0
        self.last_end = ""
        self.changing = asyncio.Lock()


class Supervisor:
    """All methods belong to one event loop. ``run`` keeps the nodes alive; when it ends, they go on without us.

    ``changed`` gets all states, sorted by name, whenever one of them changes.
    """

    def __init__(
        self, runtime_dir: Path, *, changed: Callable[[list[NodeState]], None], package: str = nodes.__name__
    ) -> None:
        self._runtime_dir = runtime_dir.absolute()
        self._changed = changed
        self._package = package
        self._nodes: dict[str, _Node] = {}
        self._group: asyncio.TaskGroup | None = None

    @property
    def states(self) -> list[NodeState]:
        return [self._nodes[name].state for name in sorted(self._nodes)]

    async def run(self) -> None:
        """Takes over what runs already, then keeps everything running until cancelled."""
        private_directory(self._runtime_dir)
        for facts in await asyncio.to_thread(running_nodes, self._runtime_dir):
            if facts.name not in self._nodes and facts.arguments[:2] == self._all_arguments(()):
                self._nodes[facts.name] = _Node(facts.name, facts.arguments[2:])
        try:
            async with asyncio.TaskGroup() as self._group:
                for node in self._nodes.values():
                    self._keep(self._group, node)
                await asyncio.Event().wait()
        finally:
            self._group = None
            for node in self._nodes.values():
                _end_spare(node)

    async def start(self, name: str, arguments: Sequence[str]) -> None:
        """Wants the node running with these arguments. Does not wait for it: a call over the bus does.

        A node that runs with other arguments is ended and started anew, unless it says that it must not be.
        """
        node = self._nodes.setdefault(name, _Node(name, arguments))
        async with node.changing:
            node.arguments = tuple(arguments)
            if node.keeping is not None:
                return
            self._tell(node, "starting", "")
            if self._group is not None:
                self._keep(self._group, node)

    async def stop(self, name: str) -> None:
        """Ends the node and waits until it has ended. Nothing happens if it does not run."""
        node = self._nodes.get(name)
        if node is None:
            return
        async with node.changing:
            if node.keeping is not None:
                node.keeping.cancel()
                await asyncio.wait([node.keeping])
                node.keeping = None
            if (spare := _end_spare(node)) is not None:
                await spare.process.ended()
            if node.process is None or node.process.has_ended():
                # Whoever kept it may have been stopped while it was still being taken over.
                facts = await asyncio.to_thread(running_node, self._runtime_dir, name)
                node.process = None if facts is None else NodeProcess.adopt(self._runtime_dir, facts)
            if node.process is not None:
                await node.process.end()
            self._tell(node, "stopped", "", restarts=0)

    def _keep(self, group: asyncio.TaskGroup, node: _Node) -> None:
        node.failures, node.last_end = 0, ""
        node.keeping = group.create_task(self._keep_running(node), name=f"keeps {node.name}")

    async def _keep_running(self, node: _Node) -> None:
        while True:
            node.process = await self._found(node) or await self._spare(node) or self._started(node)
            if node.process is None or not await self._watch(node, node.process):
                await self._pause(node)

    async def _found(self, node: _Node) -> NodeProcess | None:
        """A running process of this name, taken over."""
        facts = await asyncio.to_thread(running_node, self._runtime_dir, node.name)
        if facts is None:
            return None
        node.last_end = ""
        text = f"The {node.name} node was running already and was taken over."
        log.info(text)
        self._tell(node, "running", text)
        return NodeProcess.adopt(self._runtime_dir, facts)

    async def _spare(self, node: _Node) -> NodeProcess | None:
        """The one that waited, now that it has taken over. None where there is none, or it does not do so."""
        spare, node.spare = node.spare, None
        process = None if spare is None else spare.take(self._all_arguments(node.arguments))
        if process is None:
            return None
        node.process = process  # whoever stops the node meanwhile ends it
        taken = _Taken(process.pid, time.monotonic())
        liveness = Liveness(hung_s=_TAKES_OVER_S, start_s=_TAKES_OVER_S, busy_s=START_S)
        while not process.has_ended() and not liveness.look(taken, time.monotonic()).is_hung:
            if process.facts():
                return process
            await asyncio.sleep(_LOOK_EVERY_S / 5)
        log.error("The spare %s node did not take over. Its log is %s.", node.name, self._log(node))
        process.kill()
        with contextlib.suppress(TimeoutError):  # what a disk holds up ends later, and does nothing any more
            async with asyncio.timeout(_TAKES_OVER_S):
                await process.ended()
        return None

    def _keep_spare(self, node: _Node) -> None:
        if node.spare is not None and node.spare.process.has_ended():
            code = node.spare.process.code
            log.warning("The spare %s node ended (code %s). Its log is %s.", node.name, code, self._log(node))
            _end_spare(node)
            node.spare_again_s = time.monotonic() + _SPARE_AGAIN_S
        if node.spare is None and time.monotonic() > node.spare_again_s:
            try:
                node.spare = SpareNode(self._runtime_dir, node.name, self._package)
            except OSError:
                log.exception("A spare %s node cannot be started.", node.name)
                node.spare_again_s = time.monotonic() + _SPARE_AGAIN_S

    def _started(self, node: _Node) -> NodeProcess | None:
        try:
            return NodeProcess.start(self._runtime_dir, node.name, self._package, self._all_arguments(node.arguments))
        except Exception as error:
            # Whatever it is: the server and the other nodes go on without this one.
            log.exception("The %s node cannot be started.", node.name)
            why = error.strerror if isinstance(error, OSError) else type(error).__name__
            node.last_end = f"The {node.name} node cannot be started ({why})"
            return None

    async def _watch(self, node: _Node, process: NodeProcess) -> bool:
        """Until the process has ended. Returns True if it had to, because it was started for something else."""
        since_s = asyncio.get_running_loop().time()
        # Only the link must never be busy with anything for long.
        is_link = node.name == "link"
        liveness = Liveness(hung_s=LINK_HUNG_S, busy_s=HUNG_S, start_s=STARVED_S) if is_link else Liveness()
        hung, works_since_s = "", math.inf
        while not process.has_ended():
            if facts := process.facts():
                silence = liveness.look(facts, time.monotonic())
                if silence.is_hung and await self._hangs_still(liveness, process):
                    hung = f" after it had not answered for {silence.silent_s:.1f} s"
                    log.error("The %s node hangs and is killed.", node.name)
                    process.kill()
                self._note(node, silence)
                works_since_s = math.inf if silence.silent_s else min(works_since_s, time.monotonic())
                outdated = not silence.silent_s and self._is_outdated(node, facts)
                if outdated and await self._replace(node, process, facts):
                    return True
            if asyncio.get_running_loop().time() - since_s > _STEADY_S:
                node.failures = 0
            if node.name in SPARED and time.monotonic() - works_since_s > _STEADY_S:
                self._keep_spare(node)
            bound_log(self._log(node))
            await asyncio.sleep(_LOOK_EVERY_S)
        code = "" if process.code is None else f" (code {process.code})"
        node.last_end = f"The {node.name} node {'was ended' if hung else 'ended'}{hung or code}"
        log.warning("%s. Its log is %s.", node.last_end, self._log(node))
        return False

    async def _hangs_still(self, liveness: Liveness, process: NodeProcess) -> bool:
        """Looked at once more, after the disk, which keeps the proofs: it may have worked again meanwhile."""
        if not await silence_counts(self._runtime_dir):
            return False
        facts = process.facts()
        return facts is not None and liveness.look(facts, time.monotonic()).is_hung

    def _note(self, node: _Node, silence: Silence) -> None:
        if silence.silent_s:
            self._tell(node, "silent", f"The {node.name} node does not answer.")
        elif node.state.state != "running":
            self._tell(node, "running", f"{node.last_end} and was started again." if node.last_end else "")

    def _is_outdated(self, node: _Node, facts: NodeFacts) -> bool:
        return facts.arguments != self._all_arguments(node.arguments) or facts.version != __version__

    async def _replace(self, node: _Node, process: NodeProcess, facts: NodeFacts) -> bool:
        if not facts.replaceable:
            self._tell(node, "running", _kept(facts))
            return False
        log.info("The %s node was started for something else and is replaced.", node.name)
        self._tell(node, "starting", "")
        await process.end()
        node.last_end = ""
        return True

    async def _pause(self, node: _Node) -> None:
        pause_s = _PAUSES_S[min(node.failures, len(_PAUSES_S) - 1)]
        node.failures += 1
        self._tell(node, "restarting", f"{node.last_end}.", restarts=node.state.restarts + 1)
        await asyncio.sleep(pause_s)

    def _log(self, node: _Node) -> Path:
        return self._runtime_dir / f"{node.name}.log"

    def _all_arguments(self, arguments: Sequence[str]) -> tuple[str, ...]:
        return "--runtime", str(self._runtime_dir), *arguments

    def _tell(self, node: _Node, state: State, text: str, **changes: Any) -> None:
        after = replace(node.state, state=state, text=text, **changes)
        if after != node.state or state == "starting":
            node.state = after
            self._changed(self.states)


def _end_spare(node: _Node) -> SpareNode | None:
    spare, node.spare = node.spare, None
    if spare is not None:
        spare.end()
    return spare


def _kept(facts: NodeFacts) -> str:
    how = "with other settings" if facts.version == __version__ else f"by version {facts.version}"
    return (
        f"The {facts.name} node was started {how}. It is kept while its vehicle may be armed, and replaced after that."
    )
