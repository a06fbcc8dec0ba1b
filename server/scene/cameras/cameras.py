"""Each page's camera: where it is sent, what it follows, and which labels give way in its picture."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import viser
from viser import _messages

from server.scene.cameras.chase import Chase
from server.scene.cameras.labels import Screen, hidden, labels_of
from server.scene.cameras.projection import Lens, Pose
from server.scene.geometry.canvas import Node
from server.scene.geometry.stage import Drawing
from server.scene.host import SceneHost
from server.scene.layers.vehicles import Vehicles

CAMERAS_EVERY_S = 0.1
_TIDY_EVERY = 3
"""Of these turns: labels need not hurry."""

_STILL_M = 0.02


class Cameras:
    def __init__(
        self, host: SceneHost, vehicles: Vehicles, *, now_mono_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._host, self._vehicles = host, vehicles
        self._now_mono_s = now_mono_s
        self._chases: dict[str, tuple[str, Chase]] = {}
        self._hidden: dict[int, dict[str, Node]] = {}
        """By client: the labels it was told to hide, as they were drawn then."""
        self._turn = 0

    def free(self, page_id: str) -> None:
        self._chases.pop(page_id, None)

    def chase(self, page_id: str, actor: str) -> bool:
        """Whether there is a vehicle to follow."""
        client, pose = self._host.client(page_id), self._vehicles.pose(actor)
        if client is None or pose is None:
            return False
        chase = Chase.behind(pose.heading_rad, self._now_mono_s(), aspect=client.camera.aspect)
        self._chases[page_id] = actor, chase
        return True

    def hold(self, page_id: str, *, held: bool) -> None:
        if page_id in self._chases:
            actor, chase = self._chases[page_id]
            self._chases[page_id] = actor, chase.hold(self._now_mono_s(), held=held)

    def follow(self, drawing: Drawing) -> None:
        """Moves the cameras that follow a vehicle; those of pages that have gone are forgotten."""
        for page_id, (actor, chase) in list(self._chases.items()):
            client, pose = self._host.client(page_id), self._vehicles.pose(actor)
            if client is None:
                del self._chases[page_id]
            elif pose is not None:
                self._chases[page_id] = actor, self._followed(client, chase, drawing, pose.place_m, pose.heading_rad)

    def _followed(
        self, client: viser.ClientHandle, chase: Chase, drawing: Drawing, place_m: np.ndarray, heading_rad: float
    ) -> Chase:
        now_s = self._now_mono_s()
        if chase.is_waiting(now_s):
            return chase
        if chase.is_to_be_left:
            chase = chase.left_at(Pose(np.array(client.camera.position), np.array(client.camera.look_at)))
        chase = chase.onward(heading_rad, now_s)
        vehicle = drawing.frame.scene_from_model(place_m)
        pose = chase.pose(vehicle, ground=_ground(drawing, chase.under(vehicle)))
        if not _stands_at(client, pose):
            move(client, pose, drawing)
        return chase

    def tidy(self, nodes: Sequence[Node]) -> None:
        """Hides labels that would lie over something in a page's picture, and shows those that no longer do."""
        self._turn += 1
        if self._turn % _TIDY_EVERY:
            return
        drawn = {node.name: node for node in nodes if node.kind == "label"}
        labels, vehicles = labels_of(nodes), self._vehicles.marks()
        clients = [client for page_id in self._host.page_ids() if (client := self._host.client(page_id)) is not None]
        for client in clients:
            if client.camera.update_timestamp:
                self._tell(client, drawn, hidden(labels, vehicles, _screen(client)))
        ids = {client.client_id for client in clients}
        self._hidden = {client_id: names for client_id, names in self._hidden.items() if client_id in ids}

    def _tell(self, client: viser.ClientHandle, drawn: dict[str, Node], away: frozenset[str]) -> None:
        """A label that was drawn anew is shown again by the browser until it is told otherwise."""
        told = self._hidden.get(client.client_id, {})
        for name in away:
            if told.get(name) is not drawn[name]:
                _show(client, name, visible=False)
        for name in told.keys() - away:
            if name in drawn:
                _show(client, name, visible=True)
        self._hidden[client.client_id] = {name: drawn[name] for name in away}


def _stands_at(client: viser.ClientHandle, pose: Pose) -> bool:
    here = np.array([client.camera.position, client.camera.look_at])
    return bool(np.abs(here - [pose.position, pose.look_at]).max() < _STILL_M)


def _show(client: viser.ClientHandle, name: str, *, visible: bool) -> None:
    # viser has visibility for all clients only; its message to one of them does the same for that one.
    client.scene._websock_interface.queue_message(_messages.SetSceneNodeVisibilityMessage(name, visible))


def _screen(client: viser.ClientHandle) -> Screen:
    camera = client.camera
    return Screen(lens_of(client), max(1, camera.image_width), max(1, camera.image_height))


def _ground(drawing: Drawing, at: np.ndarray) -> float:
    """Height of the drawn ground below a place of the scene."""
    under = drawing.on_ground(drawing.frame.model_from_scene(at)[None, :2])
    return float(under[0, 2]) if len(under) else float("-inf")


def planes(drawing: Drawing) -> tuple[float, float]:
    """Near and far plane: the far default of viser, 1 km, cuts large models off."""
    return min(0.002 * drawing.frame.half_diagonal_m, 1.0), 60.0 * drawing.frame.half_diagonal_m


def move(client: viser.ClientHandle, pose: Pose, drawing: Drawing) -> None:
    with client.atomic():
        client.camera.near, client.camera.far = planes(drawing)
        client.camera.max_orbit_distance = 20.0 * drawing.frame.half_diagonal_m
        client.camera.position = tuple(pose.position)
        client.camera.look_at = tuple(pose.look_at)
    client.flush()


def lens_of(client: viser.ClientHandle) -> Lens:
    camera = client.camera
    return Lens.of(camera.wxyz, camera.position, camera.fov, camera.aspect)
