import { Marked, type Tokens } from "marked";
import type { Group, Page } from "./contents.ts";

interface Heading {
  anchor: string;
  html: string;
}

const escaped = (text: string) =>
  text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/"/g, "&quot;");

/** As MkDocs makes them, so that a link into a page holds in both. */
export const anchorOf = (heading: string) =>
  heading
    .normalize("NFKD")
    .replace(/[^\x20-\x7e]/g, "")
    .replace(/[^\w\s-]/g, "")
    .trim()
    .toLowerCase()
    .replace(/[-\s]+/g, "-");

/** `maps.md#from-a-recording` is the page `maps.html` here. */
const addressOf = (href: string) => href.replace(/^([\w-]+)\.md(?=#|$)/, "$1.html");

/** The text of a page and its second headings. */
export function bodyOf(markdown: string): { html: string; headings: Heading[] } {
  const headings: Heading[] = [];
  const marked = new Marked({
    renderer: {
      heading({ tokens, depth, text }: Tokens.Heading) {
        const html = this.parser.parseInline(tokens);
        const anchor = anchorOf(text);
        if (depth === 2) headings.push({ anchor, html });
        return `<h${depth} id="${anchor}">${html}</h${depth}>\n`;
      },
      link({ href, tokens }: Tokens.Link) {
        return `<a href="${escaped(addressOf(href))}">${this.parser.parseInline(tokens)}</a>`;
      },
      image({ href, text }: Tokens.Image) {
        return `<a href="${escaped(href)}"><img src="${escaped(href)}" alt="${escaped(text)}" /></a>`;
      },
      table(token: Tokens.Table) {
        const cells = (row: Tokens.TableCell[], name: string) =>
          row.map((cell) => `<${name}>${this.parser.parseInline(cell.tokens)}</${name}>`).join("");
        const rows = token.rows.map((row) => `<tr>${cells(row, "td")}</tr>`).join("\n");
        const head = `<thead><tr>${cells(token.header, "th")}</tr></thead>`;
        return `<div class="table"><table>${head}<tbody>\n${rows}\n</tbody></table></div>\n`;
      },
    },
  });
  return { html: marked.parse(markdown, { async: false }), headings };
}

function entry(page: Page, shown: Page, headings: Heading[]): string {
  if (page.name !== shown.name) return `<li><a href="${page.name}.html">${escaped(page.title)}</a></li>`;
  const inside = headings.map(({ anchor, html }) => `<li><a href="#${anchor}">${html}</a></li>`).join("");
  const list = inside && `<ul>${inside}</ul>`;
  return `<li><a href="${page.name}.html" aria-current="page">${escaped(page.title)}</a>${list}</li>`;
}

function contents(groups: Group[], shown: Page, headings: Heading[]): string {
  return groups
    .map(({ heading, pages }) => {
      const title = heading ? `<h2>${escaped(heading)}</h2>` : "";
      return `${title}<ul>${pages.map((page) => entry(page, shown, headings)).join("\n")}</ul>`;
    })
    .join("\n");
}

function neighbours(pages: Page[], shown: Page): string {
  const at = pages.findIndex((page) => page.name === shown.name);
  const link = (page: Page | undefined, rel: string, arrow: (title: string) => string) =>
    page ? `<a rel="${rel}" href="${page.name}.html">${arrow(escaped(page.title))}</a>` : "<span></span>";
  return `<nav class="neighbours" aria-label="Neighbouring pages">
${link(pages[at - 1], "prev", (title) => `← ${title}`)}
${link(pages[at + 1], "next", (title) => `${title} →`)}
</nav>`;
}

/** One page of Help as a whole document, which needs nothing but its style sheet and its pictures. */
export function pageOf(groups: Group[], page: Page, markdown: string): string {
  const { html, headings } = bodyOf(markdown);
  const pages = groups.flatMap((group) => group.pages);
  return `<!doctype html>
<html lang="en" data-theme="light">
<head>
<meta charset="utf-8" />
<meta name="viewport" content="width=device-width, initial-scale=1" />
<title>${escaped(page.title)} · Hedgehop Help</title>
<link rel="icon" href="data:," />
<link rel="stylesheet" href="help.css" />
<script src="theme.js"></script>
</head>
<body>
<header>
<a href="index.html">Hedgehop <b>Help</b></a>
<a class="contents-link" href="#contents">Contents</a>
<a href="/">Console</a>
</header>
<div class="page">
<nav id="contents" aria-label="Contents">
${contents(groups, page, headings)}
</nav>
<main>
<article>
${html}
</article>
${neighbours(pages, page)}
</main>
</div>
</body>
</html>
`;
}
