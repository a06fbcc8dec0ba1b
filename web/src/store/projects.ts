/** Which dropped folders are a mapping program's project, and which rasters are terrain models: by their names. */

import table from "./project_names.json";

interface Program {
  name: string;
  least: number;
  kinds: Record<string, RegExp>;
}

const PROGRAMS: readonly Program[] = table.programs.map(({ name, least, kinds }) => ({
  name,
  least,
  kinds: Object.fromEntries(
    Object.entries(kinds as Record<string, string>).map(([kind, pattern]) => [kind, new RegExp(pattern)]),
  ),
}));
const [SURFACE, TERRAIN, GROUND] = [table.surface, table.terrain, table.ground].map(
  (text) => new RegExp(text),
);
const RASTER = /\.tiff?$/;
const HEIGHTS = /\.(tiff?|asc)$/;

const partsOf = (path: string) => path.toLowerCase().split("/").filter(Boolean);
const isHidden = (path: string) =>
  path.split("/").some((part) => part.startsWith(".") || part === "__MACOSX" || part === table.tiles);

/** Whether a file is a terrain model by its name, or by the nearest of its folders that says which it is. */
export function isTerrainModel(path: string): boolean {
  const parts = partsOf(path).reverse();
  if (!HEIGHTS.test(parts[0] ?? "")) return false;
  if (GROUND!.test(parts[0]!)) return true;
  const telling = parts.find((part) => SURFACE!.test(part) || TERRAIN!.test(part));
  return telling !== undefined && !SURFACE!.test(telling);
}

/** The program whose project a folder with these paths is; null: it is none. */
export function programOf(paths: readonly string[]): string | null {
  const found = paths.filter((path) => !isHidden(path));
  for (const { name, least, kinds } of PROGRAMS) {
    const known = new Map<string, string[]>();
    for (const [kind, pattern] of Object.entries(kinds)) {
      const matching = found.filter((path) => pattern.test(path.toLowerCase()));
      known.set(kind, kind === "model" ? matching.filter((path) => !isTerrainModel(path)) : matching);
    }
    const there = [...known.values()].filter((matching) => matching.length > 0).length;
    if (there < least || !(known.get("model")?.length || known.get("cloud")?.length)) continue;
    const all = new Set([...known.values()].flat());
    const unexplained = found.some(
      (path) => RASTER.test(path.toLowerCase()) && !all.has(path) && !isTerrainModel(path),
    );
    // Common words alone make no project of a folder of tiles.
    if (name === "Metashape" && unexplained) continue;
    return name;
  }
  return null;
}
