import type { PerceptionSettings, PerceptionSettingsBody } from "../messages";

/** Settings with which a map cannot go on: it begins anew, so they are put together first and then held for. */

export const BYTES_PER_MB = 1e6;

export type AnotherMap = Partial<
  Pick<PerceptionSettings, "radar_resolution_m" | "vision_resolution_m" | "memory_limit_bytes">
>;

const KEYS = ["radar_resolution_m", "vision_resolution_m", "memory_limit_bytes"] as const;

/** What of it is another value than the present one. */
export function differing(wanted: AnotherMap, settings: PerceptionSettings): PerceptionSettingsBody {
  return Object.fromEntries(
    KEYS.filter((key) => wanted[key] !== undefined && wanted[key] !== settings[key]).map((key) => [
      key,
      wanted[key],
    ]),
  );
}

/** Which maps begin anew with it, in words; empty: none does. */
export function beginsAnew(body: PerceptionSettingsBody): string {
  const maps = body.memory_limit_bytes
    ? ["radar's", "camera's", "range finder's"]
    : [
        ...(body.radar_resolution_m ? ["radar's"] : []),
        ...(body.vision_resolution_m ? ["camera's", "range finder's"] : []),
      ];
  if (maps.length === 0) return "";
  const last = maps[maps.length - 1];
  const names = maps.length === 1 ? last : `${maps.slice(0, -1).join(", ")} and ${last}`;
  const verb = maps.length === 1 ? "map begins" : "maps begin";
  return `The ${names} ${verb} anew: what was seen so far is forgotten here. Recordings keep it.`;
}
