/** Files of dropped folders, and where they lay: the browser tells nothing of single files' folders. */

const folders = new WeakMap<File, string>();
const DEEPEST = 4;
const OPENED =
  /\.(tiff?|asc|zip|las|laz|ply|pcd|e57|csv|geojson|json|kml|kmz|waypoints|plan|tlog|mcap|ulg|npz|npy|bin|bag|db3)$/i;

export const folderOf = (file: File): string => folders.get(file) ?? "";

const OF_PROJECT =
  /\/(odm_dem\/dsm|odm_orthophoto\/odm_orthophoto)\.tif$|_densified_point_cloud[^/]*\.la[sz]$/i;

/** Files of a dropped folder that is a mapping program's project: apart they would become models that are none. */
export const partsOfProject = (files: readonly File[]): File[] =>
  files.some((file) => folderOf(file) && OF_PROJECT.test(`/${folderOf(file)}/${file.name}`))
    ? files.filter((file) => folderOf(file))
    : [];

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
