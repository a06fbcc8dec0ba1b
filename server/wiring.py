"""Joins the open plan to its 3D view."""

from __future__ import annotations

from server.hub import Hub
from server.library import Library
from server.scene.host import SceneHost
from server.scene.view import SceneView
from server.together import Background
from server.workspace import Workspace


def make_workspace(library: Library, hub: Hub, host: SceneHost, background: Background) -> Workspace:
    view = SceneView(host)
    workspace = Workspace(library, hub, view, spawn=background.spawn)
    view.attach(workspace)
    return workspace
