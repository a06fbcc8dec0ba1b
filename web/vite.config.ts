import { defineConfig } from "vitest/config";
import { helpPages } from "./src/help/build.ts";

// `npm run dev` serves the sources and passes everything else to a running Hedgehop server.
const SERVER = "http://127.0.0.1:8000";

export default defineConfig({
  plugins: [helpPages()],
  oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
  build: {
    target: "es2022",
    // The page's content security policy forbids inline scripts, and data: addresses with them.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    license: { fileName: "licences.md" },
  },
  server: {
    proxy: {
      "/api": SERVER,
      "/help": SERVER,
      "/login": SERVER,
      "/signin": SERVER,
      "/view": { target: SERVER, ws: true },
      "/ws": { target: SERVER, ws: true },
    },
  },
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});
