import type { PlaceDoc, PlanDoc, PoiDoc } from "../messages";

/** Pure changes of the list of points. */

export function moved<T>(list: readonly T[], from: number, to: number): T[] {
  const item = list[from];
  if (item === undefined || to < 0 || to >= list.length) return [...list];
  const rest = list.filter((_, index) => index !== from);
  return [...rest.slice(0, to), item, ...rest.slice(to)];
}

export const withPoi =
  (id: string, fields: Partial<PoiDoc>) =>
  (plan: PlanDoc): PlanDoc => ({
    ...plan,
    pois: plan.pois.map((poi) => (poi.id === id ? { ...poi, ...fields } : poi)),
  });

export const withoutPoi =
  (id: string) =>
  (plan: PlanDoc): PlanDoc => ({ ...plan, pois: plan.pois.filter((poi) => poi.id !== id) });

/** Moves a point to a place in the list, wherever it is by then. */
export const withPoiAt =
  (id: string, to: number) =>
  (plan: PlanDoc): PlanDoc => ({
    ...plan,
    pois: moved(
      plan.pois,
      plan.pois.findIndex((poi) => poi.id === id),
      to,
    ),
  });

export const poiTitle = (poi: PoiDoc, index: number) => poi.name || `Point ${index + 1}`;

/** "46.1234567, 7.1234567" as typed or pasted; null when it is no place on earth. */
export function parsePlace(text: string): PlaceDoc | null {
  const parts = text.trim().split(/[\s,;]+/);
  if (parts.length !== 2) return null;
  const [lat_deg, lon_deg] = parts.map(Number);
  if (lat_deg === undefined || lon_deg === undefined) return null;
  const isPlace = Math.abs(lat_deg) <= 90 && Math.abs(lon_deg) <= 180;
  return isPlace ? { lat_deg, lon_deg } : null;
}
