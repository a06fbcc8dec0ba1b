"""What the 3D view shows and which tool is in hand: shared by all pages, not part of the plan."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from server.schemas.plan_docs import PlaceDoc
from server.schemas.strict_model import Strict
from server.schemas.traversability_docs import LayerName


class ViewDoc(Strict):
    """What the 3D view shows; shared by all pages, not part of the plan."""

    shading: Literal["height", "hillshade", "orthophoto"] = "height"
    show_points: bool = False
    """The points of the cloud that the surface model on show was made of."""
    show_textured: bool = False
    """The textured mesh that belongs to the surface model on show: a picture, by which nothing is judged."""
    show_mesh: bool = True
    """The surface model itself beside its points or its textured mesh; without them it is always shown."""
    show_surface: bool = True
    show_path: bool = True
    show_unknown: bool = True
    show_radar_map: bool = True
    show_vision_map: bool = True
    """The camera's voxels, and those of range finders."""
    show_vision_flight: bool = False
    """All that the camera has seen on its way."""
    show_cloud: bool = False
    """The camera's newest points, some of them."""
    show_explained: bool = False
    """Voxels that are known ground, in grey: they would crowd the view from behind the vehicle."""
    show_regions: bool = True
    show_tracks: bool = True
    show_traffic: bool = True
    show_traversability: bool = False
    """Untraversable ground, cleared foliage and landing sites."""
    traversability_layer: LayerName = "cleared"
    vertical_exaggeration: Annotated[float, Field(ge=1, le=5)] = 1.0
    legend_min_m: float | None = None
    legend_max_m: float | None = None
    points_shown: int = 0
    """Points that the surface model on show has to draw; 0: it has none."""
    points_state: Literal["none", "loading", "drawn", "failed"] = "none"
    """What has become of them; those that failed are asked for again when they are put off and on."""
    points_of: int = 0
    """Points of the file that they are of."""
    points_colored: bool = False
    """By the file; else by height, as the model is."""
    textured_triangles: int = 0
    """Of the textured mesh that the surface model on show has; 0: it has none."""
    textured_state: Literal["none", "loading", "drawn", "failed"] = "none"
    """What has become of it, as of the points."""


class SelectionDoc(Strict):
    """Which tool clicks in the 3D view act through, and what is selected."""

    tool: Literal[
        "select", "add_poi", "polygon", "home", "look_at", "landing", "there", "fence_polygon", "fence_circle", "rally"
    ] = "select"
    poi_id: str | None = None
    fence_mark: str | None = None
    """Id of the fence's shape or of the rally point that is selected; a corner's number after a dot, from 0."""
    draft: list[PlaceDoc] = Field(default=[], max_length=2)
    """Corners of a polygon of the fence that is none yet."""
    place: PlaceDoc | None = None
    """Clicked with the tool "landing" or "there": sites are looked for near it, or a guided way leads there."""
    site_rank: int | None = None
    """Of the landing site that is pointed out."""
