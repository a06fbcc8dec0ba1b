"""What is drawn, as data; and the canvas that sends only what differs from what browsers already have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser

Ready = Callable[[Any], None]


@dataclass(frozen=True, slots=True)
class Node:
    """One node of the scene tree; a name below another node's name moves with it."""

    name: str
    kind: str
    """The scene's method that adds it, without "add_"."""
    props: Mapping[str, Any]
    ready: Ready | None = field(default=None, compare=False)
    """Called with the handle of a newly added node, to attach callbacks."""


class Canvas:
    """The nodes that browsers have. Not thread-safe: one drawer at a time."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._layers: dict[str, dict[str, Node]] = {}
        self._handles: dict[str, Any] = {}

    def draw(self, layers: Mapping[str, list[Node]]) -> None:
        """Puts all of them on show at once."""
        if not layers:
            return
        with self._server.atomic():
            for name, nodes in layers.items():
                self.put(name, nodes)
        self._server.flush()

    def put(self, layer: str, nodes: list[Node]) -> None:
        """Makes ``nodes`` the whole content of ``layer``; parents come before their children."""
        before = self._layers.get(layer, {})
        after = {node.name: node for node in nodes}
        for name in [name for name in before if name not in after]:
            self._remove(name)
        for node in nodes:
            self._draw(before.get(node.name), node)
        self._layers[layer] = after

    @property
    def nodes(self) -> list[Node]:
        """All that is drawn, parents before their children."""
        return [node for layer in self._layers.values() for node in layer.values()]

    def handle(self, name: str) -> Any | None:
        return self._handles.get(name)

    def _draw(self, old: Node | None, new: Node) -> None:
        handle = self._handles.get(new.name)
        if old is None or handle is None or not _assignable(old, new):
            self._remove(new.name)
            self._handles[new.name] = getattr(self._server.scene, f"add_{new.kind}")(new.name, **new.props)
            if new.ready is not None:
                new.ready(self._handles[new.name])
            return
        for key, value in new.props.items():
            if key == "position" or not _same(old.props[key], value):
                # Poses are compared by the handle: a browser may have dragged the node.
                setattr(handle, key, value)

    def _remove(self, name: str) -> None:
        handle = self._handles.pop(name, None)
        if handle is None:
            return
        for child in [other for other in self._handles if other.startswith(f"{name}/")]:
            del self._handles[child]
        handle.remove()


def _assignable(old: Node, new: Node) -> bool:
    """Whether the difference travels as single properties: same kind, and arrays of the same shape."""
    if old.kind != new.kind or old.props.keys() != new.props.keys():
        return False
    return all(np.shape(old.props[key]) == np.shape(new.props[key]) for key in new.props)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return a is b or bool(np.array_equal(a, b))
    return bool(a == b)
