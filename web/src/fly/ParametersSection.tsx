import { adopted } from "../store/flying";
import { parameters } from "../store/parameters";
import { openDialog } from "../store/view";
import { Button } from "../ui/Button";
import { Section } from "../ui/Section";

function summaryOf(): string {
  const findings = parameters.value?.findings;
  if (!findings) return "not looked at";
  const bad = findings.filter(({ state }) => state === "bad").length;
  return bad > 0 ? `${bad} to be changed` : "nothing to be changed";
}

/** The way to the vehicle's own settings: the rest of the page is about the plan. */
export function ParametersSection() {
  if (!adopted.value) return null;
  return (
    <Section id="parameters" title="Parameters" icon="menu" summary={summaryOf()} startsOpen>
      <Button icon="shield" testid="open-parameters" onClick={() => (openDialog.value = "parameters")}>
        Before a low flight, and all parameters
      </Button>
    </Section>
  );
}
