import { describe, expect, it } from "vitest";
import mkdocs from "../../mkdocs.yml?raw";
import { contentsOf } from "../src/help/contents";
import { OFTEN_READ } from "../src/help/HelpPages";
import { anchorOf, bodyOf, pageOf } from "../src/help/render";

const groups = contentsOf(mkdocs);
const pages = groups.flatMap((group) => group.pages);

describe("contents of Help", () => {
  it("are those of mkdocs.yml, in its order", () => {
    expect(groups.map((group) => group.heading)).toEqual([null, "How to", "Reference"]);
    expect(pages.slice(0, 3).map((page) => page.name)).toEqual(["index", "first-flight", "vehicle-profile"]);
  });

  it("hold the pages that the help sheet names", () => {
    const names = pages.map((page) => page.name);
    expect(OFTEN_READ.filter((page) => !names.includes(page.name))).toEqual([]);
  });

  it("refuse what is no page", () => {
    expect(() => contentsOf("nav:\n  - Hedgehop: https://example.com\n")).toThrow("not a page");
  });
});

describe("a page of Help", () => {
  it("links to pages, places and pictures beside it", () => {
    const { html } = bodyOf(
      "[a](maps.md#from-a-recording) [b](#here) [c](https://x.test/y.md)\n\n![P](fly.webp)",
    );
    expect(html).toContain('href="maps.html#from-a-recording"');
    expect(html).toContain('href="#here"');
    expect(html).toContain('href="https://x.test/y.md"');
    expect(html).toContain('<img src="fly.webp" alt="P" />');
  });

  it("names its headings as MkDocs does", () => {
    expect(anchorOf("1. Give it the ground")).toBe("1-give-it-the-ground");
    expect(anchorOf("A TI radar: `--ti-config`, 2 × 3")).toBe("a-ti-radar-ti-config-2-3");
    expect(bodyOf("## Two *words*").headings).toEqual([{ anchor: "two-words", html: "Two <em>words</em>" }]);
  });

  it("shows where it stands and what comes before and after", () => {
    const html = pageOf(groups, pages[1]!, "# First flight\n\n## Start\n");
    expect(html).toContain('<a href="first-flight.html" aria-current="page">First flight</a>');
    expect(html).toContain('<li><a href="#start">Start</a></li>');
    expect(html).toContain('rel="prev" href="index.html"');
    expect(html).toContain('rel="next" href="vehicle-profile.html"');
  });

  it("keeps code as it is, and tables within the page", () => {
    const { html } = bodyOf("```sh\na <b> & c\n```\n\n| x |\n|---|\n| `a|b` |\n");
    expect(html).toContain("a &lt;b&gt; &amp; c");
    expect(html).toContain('<div class="table"><table>');
  });
});
