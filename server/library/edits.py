"""What a click or a drag in the 3D view does to the document: pure functions."""

from __future__ import annotations

import secrets

from server.schemas import PlaceDoc, PlanDoc, PoiDoc, SelectionDoc


def new_poi_id() -> str:
    return secrets.token_urlsafe(6).replace("-", "a").replace("_", "b")


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
    """(undo label, new document, new selection) for a click on the terrain; None when it edits nothing."""
    place = PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg)
    match selection.tool:
        case "add_poi":
            name = next_poi_name(document)
            poi = PoiDoc(id=new_poi_id(), lat_deg=lat_deg, lon_deg=lon_deg, name=name)
            added = document.model_copy(update={"pois": [*document.pois, poi], "source": "pois"})
            return f"Add {name}", added, selection.model_copy(update={"poi_id": poi.id})
        case "polygon":
            survey = document.survey.model_copy(update={"polygon": [*document.survey.polygon, place]})
            return "Add corner", document.model_copy(update={"survey": survey, "source": "survey"}), selection
        case "home":
            return "Set home", document.model_copy(update={"home": place}), SelectionDoc(tool="select")
        case "look_at":
            mission = document.mission.model_copy(update={"heading": "point", "look_at": place})
            return "Look at a point", document.model_copy(update={"mission": mission}), SelectionDoc(tool="select")
        case _:
            return None


def moved(document: PlanDoc, poi_id: str, lat_deg: float, lon_deg: float) -> tuple[str, PlanDoc] | None:
    """(undo label, new document) for a POI dragged to a place; None when the POI is gone."""
    names = {poi.id: poi.name or "point" for poi in document.pois}
    if poi_id not in names:
        return None
    pois = [
        poi.model_copy(update={"lat_deg": lat_deg, "lon_deg": lon_deg}) if poi.id == poi_id else poi
        for poi in document.pois
    ]
    return f"Move {names[poi_id]}", document.model_copy(update={"pois": pois})
