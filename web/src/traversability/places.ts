import type { PlaceDoc, PlanDoc } from "../messages";
import { heard } from "../store/flying";
import { poiTitle } from "../store/poi";
import { selection } from "../store/state";

/** A place that landing sites can be asked for, with the reason why it cannot be. */
export interface Asked {
  id: "home" | "point" | "vehicle";
  label: string;
  place: PlaceDoc | null;
  why: string;
}

function point(plan: PlanDoc): Asked {
  const index = plan.pois.findIndex((poi) => poi.id === selection.value.poi_id);
  const poi = plan.pois[index];
  return {
    id: "point",
    label: poi ? poiTitle(poi, index) : "Point",
    place: poi ?? null,
    why: "Select a point first",
  };
}

/** Home, the selected point and the vehicle. */
export function places(plan: PlanDoc): Asked[] {
  const state = heard.live.value?.message.state;
  const vehicle =
    state?.lat_deg != null && state.lon_deg != null
      ? { lat_deg: state.lat_deg, lon_deg: state.lon_deg }
      : null;
  return [
    {
      id: "home",
      label: "Home",
      place: plan.home ?? plan.pois[0] ?? null,
      why: "The plan has no home yet",
    },
    point(plan),
    { id: "vehicle", label: "Vehicle", place: vehicle, why: "No vehicle is connected" },
  ];
}
