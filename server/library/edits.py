"""What a click or a drag in the 3D view does to the document: pure functions."""

from __future__ import annotations

from server.library.fences import clicked_circle, clicked_polygon, clicked_rally, moved_mark
from server.library.whole_files import new_id
from server.schemas import PlaceDoc, PlanDoc, PoiDoc, SelectionDoc


def next_poi_name(document: PlanDoc) -> str:
    """The smallest free "P<number>"."""
    taken = {poi.name for poi in document.pois}
    number = 1
    while f"P{number}" in taken:
        number += 1
    return f"P{number}"


def clicked(
    document: PlanDoc, selection: SelectionDoc, lat_deg: float, lon_deg: float
) -> tuple[str, PlanDoc, SelectionDoc] | None:
    """(undo label, new document, new selection) for a click on the terrain; None when it edits nothing.

    The second click of a double click is on the very place of the first, and adds nothing.
    """
    place = PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg)
    match selection.tool:
        case "add_poi":
            if document.pois and _place(document.pois[-1]) == place:
                return None
            name = next_poi_name(document)
            poi = PoiDoc(id=new_id(), lat_deg=lat_deg, lon_deg=lon_deg, name=name)
            added = document.model_copy(update={"pois": [*document.pois, poi], "source": "pois"})
            return f"Add {name}", added, selection.model_copy(update={"poi_id": poi.id, "fence_mark": None})
        case "polygon":
            if document.survey.polygon[-1:] == [place]:
                return None
            survey = document.survey.model_copy(update={"polygon": [*document.survey.polygon, place]})
            return "Add corner", document.model_copy(update={"survey": survey, "source": "survey"}), selection
        case "home":
            return "Set home", document.model_copy(update={"home": place}), SelectionDoc(tool="select")
        case "look_at":
            mission = document.mission.model_copy(update={"heading": "point", "look_at": place})
            return "Look at a point", document.model_copy(update={"mission": mission}), SelectionDoc(tool="select")
        case "fence_polygon":
            return clicked_polygon(document, selection, place)
        case "fence_circle":
            return clicked_circle(document, selection, place)
        case "rally":
            return clicked_rally(document, selection, place)
        case _:
            return None


def _place(poi: PoiDoc) -> PlaceDoc:
    return PlaceDoc(lat_deg=poi.lat_deg, lon_deg=poi.lon_deg)


def picked(document: PlanDoc, selection: SelectionDoc, mark: str) -> SelectionDoc:
    """The selection after a click on a point of interest, or on a mark of the fence."""
    is_poi = any(poi.id == mark for poi in document.pois)
    chosen = {"poi_id": mark, "fence_mark": None} if is_poi else {"poi_id": None, "fence_mark": mark}
    return selection.model_copy(update=chosen)


def moved(document: PlanDoc, mark: str, lat_deg: float, lon_deg: float) -> tuple[str, PlanDoc] | None:
    """(undo label, new document) for a mark dragged to a place; None when it is gone."""
    names = {poi.id: poi.name or "point" for poi in document.pois}
    if mark not in names:
        return moved_mark(document, mark, PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg))
    pois = [
        poi.model_copy(update={"lat_deg": lat_deg, "lon_deg": lon_deg}) if poi.id == mark else poi
        for poi in document.pois
    ]
    return f"Move {names[mark]}", document.model_copy(update={"pois": pois})
