/** Some of the pages of Help, which open in a tab of their own: the console stays as it is. */
export const OFTEN_READ = [
  { name: "first-flight", title: "First flight" },
  { name: "vehicle-profile", title: "Vehicle profile" },
  { name: "companion-computer", title: "Companion computer" },
  { name: "field-laptop", title: "Field laptop" },
  { name: "conventions", title: "Conventions" },
  { name: "glossary", title: "Glossary" },
  { name: "index", title: "All pages" },
] as const;

/** The tab that is there already, or a new one. */
const TAB = "hedgehop-help";

const addressOf = (name: string) => `/help/${name}.html`;

export const openHelpPages = () => void window.open(addressOf("index"), TAB);

export function HelpPages() {
  return (
    <nav class="help-pages" aria-label="Pages of Help" data-testid="help-pages">
      {OFTEN_READ.map(({ name, title }) => (
        <a key={name} href={addressOf(name)} target={TAB}>
          {title}
        </a>
      ))}
    </nav>
  );
}
