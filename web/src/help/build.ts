import type { Plugin } from "vite";
import { contentsOf } from "./contents.ts";
import { pageOf } from "./render.ts";

const PICTURE = /\.(webp|svg)$/;

/** Puts the documents into the built console: `help/NAME.html` for each page, beside its pictures and its style. */
export function helpPages(): Plugin {
  let web = "";
  return {
    name: "hedgehop-help",
    apply: "build",
    configResolved: ({ root }) => void (web = root),
    async generateBundle() {
      const text = (path: string) => this.fs.readFile(`${web}/${path}`, { encoding: "utf8" });
      const emit = (name: string, source: string | Uint8Array) =>
        this.emitFile({ type: "asset", fileName: `help/${name}`, source });
      const groups = contentsOf(await text("../mkdocs.yml"));
      for (const page of groups.flatMap((group) => group.pages))
        emit(`${page.name}.html`, pageOf(groups, page, await text(`../docs/${page.name}.md`)));
      for (const name of await this.fs.readdir(`${web}/../docs`))
        if (PICTURE.test(name)) emit(name, await this.fs.readFile(`${web}/../docs/${name}`));
      emit("help.css", (await text("src/styles/tokens.css")) + (await text("src/help/help.css")));
      emit("theme.js", await text("src/help/theme.js"));
    },
  };
}
