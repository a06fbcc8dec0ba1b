/** The pages of Help and their order, as `nav` in mkdocs.yml has them. */

export interface Page {
  title: string;
  /** File name without its ending, the same in `docs/` and in the browser. */
  name: string;
}

/** Pages under one heading; those that stand by themselves have none. */
export interface Group {
  heading: string | null;
  pages: Page[];
}

const PAGE = /^( +)- (.+): ([\w-]+)\.md$/;
const HEADING = /^ {2}- (.+):$/;

/** Two levels of one list, a line each: all that `nav` needs of YAML. */
export function contentsOf(mkdocsYaml: string): Group[] {
  const [, nav] = mkdocsYaml.split(/^nav:$/m);
  const groups: Group[] = [];
  for (const line of (nav ?? "").trimEnd().split("\n").slice(1)) {
    const heading = HEADING.exec(line);
    if (heading?.[1]) {
      groups.push({ heading: heading[1], pages: [] });
      continue;
    }
    const [, indent = "", title, name] = PAGE.exec(line) ?? [];
    if (!title || !name) throw new Error(`mkdocs.yml: not a page of nav: ${line}`);
    groupFor(groups, indent.length > 2).pages.push({ title, name });
  }
  return groups;
}

function groupFor(groups: Group[], isInside: boolean): Group {
  const last = groups.at(-1);
  if (last && isInside === (last.heading !== null)) return last;
  const group: Group = { heading: null, pages: [] };
  groups.push(group);
  return group;
}
