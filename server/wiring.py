"""Joins the open plan to its 3D view, and flying to both."""

from __future__ import annotations

from server.door.hub import Hub
from server.library import Library
from server.scene.host import SceneHost
from server.scene.view import SceneView
from server.settings import Settings
from server.stations import Flying
from server.work.task_group import Background
from server.workspace import Workspace


async def open_flying(settings: Settings, library: Library, hub: Hub, workspace: Workspace) -> Flying:
    """The server's place on the bus. Raises BusError."""
    return await Flying.open(library, hub, workspace, settings)


def make_workspace(library: Library, hub: Hub, host: SceneHost, background: Background) -> Workspace:
    """Clicks in the view become edits of the workspace, whose pictures the view draws."""
    workspace: Workspace

    async def on_terrain_click(page_id: str | None, lat_deg: float, lon_deg: float, known: bool) -> None:
        del page_id
        if workspace.picture.review is None:
            await workspace.pointing.on_terrain(lat_deg, lon_deg, known=known)

    async def on_poi_click(poi_id: str) -> None:
        workspace.pointing.on_poi(poi_id)

    async def on_poi_moved(poi_id: str, lat_deg: float, lon_deg: float) -> None:
        await workspace.pointing.on_poi_moved(poi_id, lat_deg, lon_deg)

    view = SceneView(
        host.server,
        on_terrain_click=on_terrain_click,
        on_poi_click=on_poi_click,
        on_poi_moved=on_poi_moved,
        page_of_client=host.page_of_client,
    )
    background.spawn(view.run())
    workspace = Workspace(library, hub, view, spawn=background.spawn, stage=view.vehicles, sights=view.sights)
    return workspace
