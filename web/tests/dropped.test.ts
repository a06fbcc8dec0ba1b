import { describe, expect, it } from "vitest";
import { droppedFiles, folderOf, partsOfProjects, terrainModels } from "../src/store/dropped";

const file = (name: string) => new File(["x"], name);

function fileEntry(name: string, fullPath: string) {
  return { isDirectory: false, name, fullPath, file: (done: (f: File) => void) => done(file(name)) };
}

/** Gives its entries two at a time, as browsers give a hundred. */
function folderEntry(name: string, fullPath: string, entries: unknown[]) {
  const createReader = () => {
    let given = 0;
    return {
      readEntries: (done: (some: unknown[]) => void) => {
        done(entries.slice(given, given + 2));
        given += 2;
      },
    };
  };
  return { isDirectory: true, name, fullPath, createReader };
}

function drop(entries: unknown[], files: File[]): DataTransfer {
  return {
    items: entries.map((entry) => ({ webkitGetAsEntry: () => entry })),
    files,
  } as unknown as DataTransfer;
}

describe("dropped files", () => {
  it("come as they are, without a folder", async () => {
    const one = file("dsm.tif");
    const found = await droppedFiles(drop([{ isDirectory: false }], [one]));
    expect(found).toEqual([one]);
    expect(folderOf(one)).toBe("");
  });

  it("of folders are those that can be opened, with the folder that each lies in", async () => {
    const inner = folderEntry("west", "/survey/west", [fileEntry("dsm.tif", "/survey/west/dsm.tif")]);
    const outer = folderEntry("survey", "/survey", [
      fileEntry("dsm.tif", "/survey/dsm.tif"),
      fileEntry("notes.docx", "/survey/notes.docx"),
      inner,
      fileEntry("points.csv", "/survey/points.csv"),
    ]);
    const found = await droppedFiles(drop([outer], [file("survey")]));
    expect(found.map((f) => [folderOf(f), f.name])).toEqual([
      ["survey", "dsm.tif"],
      ["survey/west", "dsm.tif"],
      ["survey", "points.csv"],
    ]);
  });

  it("of a folder that is a project are known as its parts, and those beside it are not", async () => {
    const odm = (name: string) => {
      const inner = folderEntry("odm_dem", `/${name}/odm_dem`, [
        fileEntry("dsm.tif", `/${name}/odm_dem/dsm.tif`),
      ]);
      return folderEntry(name, `/${name}`, [inner, fileEntry("notes.csv", `/${name}/notes.csv`)]);
    };
    const points = file("points.csv");
    const found = await droppedFiles(drop([odm("all"), { isDirectory: false }], [file("all"), points]));
    expect(found).toContain(points);
    expect(partsOfProjects(found).map((f) => f.name)).toEqual(["dsm.tif", "notes.csv"]);
  });

  it("of a folder with a tileset, or with glTF as text, are parts of one mesh", async () => {
    for (const name of ["tileset.json", "house.gltf"]) {
      const mesh = folderEntry("model", "/model", [
        fileEntry(name, `/model/${name}`),
        fileEntry("a.glb", "/model/a.glb"),
      ]);
      const found = await droppedFiles(drop([mesh], [file("model")]));
      expect(partsOfProjects(found).map((f) => f.name)).toEqual([name, "a.glb"]);
    }
    const alone = folderEntry("model", "/model", [fileEntry("a.glb", "/model/a.glb")]);
    expect(partsOfProjects(await droppedFiles(drop([alone], [file("model")])))).toEqual([]);
  });

  it("that lie in a folder of tiles, or alone, are no project", async () => {
    const tiles = folderEntry("odm", "/odm", [fileEntry("dsm.tif", "/odm/dsm.tif")]);
    const found = await droppedFiles(drop([tiles], [file("odm")]));
    expect(partsOfProjects([...found, file("x_densified_point_cloud.las")])).toEqual([]);
  });

  const names = (files: readonly File[]) => files.map((f) => f.name);

  async function folder(top: string, paths: readonly string[]): Promise<File[]> {
    const entries = paths.map((path) => {
      const [name, ...above] = path.split("/").reverse();
      return above.reduce<unknown>(
        (inside, part) => folderEntry(part, `/${top}/${part}`, [inside]),
        fileEntry(name!, `/${top}/${path}`),
      );
    });
    return droppedFiles(drop([folderEntry(top, `/${top}`, entries)], [file(top)]));
  }

  it.each([
    ["Metashape", ["hill_dem.tif", "hill_orthomosaic.tif"]],
    ["Pix4D without a cloud", ["1_dsm/hill_dsm.tif", "2_mosaic/hill_mosaic_group1.tif", "dtm/hill_dtm.tif"]],
    ["Pix4D", ["hill_dsm.tif", "hill_densified_point_cloud.las"]],
    ["WebODM", ["odm_dem/dsm.tif", "odm_dem/dtm.tif"]],
  ])("of a folder of %s are not taken apart", async (_, paths) => {
    const found = await folder("survey", paths);
    expect(found).toHaveLength(paths.length);
    expect(partsOfProjects(found)).toHaveLength(paths.length);
  });

  it("of two folders are told apart", async () => {
    const [project, tiles] = [await folder("a", ["dem.tif", "ortho.tif"]), await folder("b", ["1.tif"])];
    expect(names(partsOfProjects([...project, ...tiles]))).toEqual(["dem.tif", "ortho.tif"]);
  });

  it("that are terrain models by their name or folder are told; a file alone is opened", async () => {
    const found = await folder("survey", [
      "a_dtm.tif",
      "b_dsm.tif",
      "dtm.asc",
      "points.csv",
      "dtm_notes.csv",
    ]);
    expect(partsOfProjects(found)).toEqual([]);
    expect(names(terrainModels([...found, file("c_dtm.tif")]))).toEqual(["a_dtm.tif", "dtm.asc"]);
    expect(names(terrainModels(await folder("dtm", ["1.tif", "2_dsm.tif"])))).toEqual(["1.tif"]);
  });
});
