/** Imports of the console go down only, and no file imports itself in a circle. */

/** From the roof to the ground; those of one floor do not know each other. */
const FLOORS = [
  ["main"],
  ["shell"],
  ["scene"],
  ["plan", "fly", "review", "account"],
  ["studies", "vehicle", "traversability"],
  ["chart", "tracks", "traffic"],
  ["obstacles"],
  ["ui", "help"],
  ["store"],
  ["net", "help"],
];

const forbid = (files, ...patterns) => ({
  files,
  rules: { "no-restricted-imports": ["error", { patterns }] },
});

/** A folder is closed to its own floor and to those above. */
function closed(folder) {
  const floor = FLOORS.findIndex((folders) => folders.includes(folder));
  const others = FLOORS.slice(0, floor + 1).flat();
  return {
    regex: `^(\\.\\./)+(${others.filter((other) => other !== folder).join("|")})(/|$)`,
    message: `Imports go down only: ${FLOORS.map((folders) => folders.join(", ")).join(" > ")}.`,
  };
}

const HOMELESS = { regex: "^\\.\\./", message: "A new folder wants a floor in oxlint.config.mjs first." };
const PARENT = { regex: "^\\.\\./[^.]", message: "A section does not know the panel that it stands in." };
const SIBLING = { regex: "^\\./", message: "Messages and formats stand on nothing." };

export default {
  plugins: ["import"],
  categories: { correctness: "off" },
  rules: { "import/no-cycle": ["error", { ignoreTypes: false }] },
  overrides: [
    forbid(["src/*/**"], HOMELESS),
    ...FLOORS.slice(1)
      .flat()
      .map((folder) => forbid([`src/${folder}/**`], closed(folder))),
    forbid(["src/plan/sections/**"], closed("plan"), PARENT),
    forbid(["src/{messages,format}.ts"], SIBLING),
  ],
};
