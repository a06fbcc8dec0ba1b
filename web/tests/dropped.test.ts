import { describe, expect, it } from "vitest";
import { droppedFiles, folderOf, partsOfProject } from "../src/store/dropped";

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
    expect(partsOfProject(found).map((f) => f.name)).toEqual(["dsm.tif", "notes.csv"]);
  });

  it("that lie in a folder of tiles, or alone, are no project", async () => {
    const tiles = folderEntry("odm", "/odm", [fileEntry("dsm.tif", "/odm/dsm.tif")]);
    const found = await droppedFiles(drop([tiles], [file("odm")]));
    expect(partsOfProject([...found, file("x_densified_point_cloud.las")])).toEqual([]);
  });
});
