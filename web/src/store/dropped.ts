/** Files of dropped folders, and where they lay: the browser tells nothing of single files' folders. */

import { isTerrainModel, programOf } from "./projects";

const folders = new WeakMap<File, string>();
const DEEPEST = 4;
const OPENED =
  /\.(tiff?|asc|zip|las|laz|ply|pcd|e57|glb|gltf|csv|geojson|json|kml|kmz|waypoints|plan|tlog|mcap|ulg|npz|npy|bin|bag|db3)$/i;

export const folderOf = (file: File): string => folders.get(file) ?? "";

const pathOf = (file: File) => `${folderOf(file)}/${file.name}`;

/** Files of dropped folders that are mapping programs' projects: apart they would become models that are none. */
export function partsOfProjects(files: readonly File[]): File[] {
  const tops = new Map<string, File[]>();
  for (const file of files.filter((file) => folderOf(file))) {
    const top = folderOf(file).split("/")[0]!;
    tops.set(top, [...(tops.get(top) ?? []), file]);
  }
  return [...tops.values()].filter((inside) => isProject(inside)).flat();
}

/** Apart, the files of a tileset or of a mesh as text would be none. */
const isProject = (inside: File[]) =>
  programOf(inside.map(pathOf)) !== null || inside.some(({ name }) => /(^tileset\.json|\.gltf)$/i.test(name));

/** Rasters of dropped folders that are terrain models by name: trees and buildings are missing in them. */
export const terrainModels = (files: readonly File[]): File[] =>
  files.filter((file) => folderOf(file) && isTerrainModel(pathOf(file)));

/** All files dropped; of folders those that can be opened, whichever folder they lie in. */
export async function droppedFiles(data: DataTransfer): Promise<File[]> {
  // Entries must be taken before the first wait: then the list is emptied.
  const entries = [...data.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...data.files];
  const found: File[] = [];
  for (const [index, entry] of entries.entries()) {
    if (entry?.isDirectory) found.push(...(await filesIn(entry as FileSystemDirectoryEntry, DEEPEST)));
    else if (plain[index]) found.push(plain[index]);
  }
  return found;
}

async function filesIn(folder: FileSystemDirectoryEntry, depth: number): Promise<File[]> {
  if (depth === 0) return [];
  const found: File[] = [];
  for (const entry of await entriesOf(folder)) {
    if (entry.isDirectory) found.push(...(await filesIn(entry as FileSystemDirectoryEntry, depth - 1)));
    else if (OPENED.test(entry.name)) found.push(await fileOf(entry as FileSystemFileEntry, folder.fullPath));
  }
  return found;
}

/** A reader gives some at a time, and none when it is through. */
async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((done, failed) => reader.readEntries(done, failed));
    if (some.length === 0) return all;
    all.push(...some);
  }
}

async function fileOf(entry: FileSystemFileEntry, folder: string): Promise<File> {
  const file = await new Promise<File>((done, failed) => entry.file(done, failed));
  folders.set(file, folder.replace(/^\//, ""));
  return file;
}
