import type { FindingDoc, ParametersDoc } from "../messages";
import { outcomesPending, whyNotWrite } from "./parameter_writing";
import { writeParameter } from "../store/parameters";
import { Button } from "../ui/Button";
import { Icon, type IconName } from "../ui/Icon";

const MARKS: Record<FindingDoc["state"], { icon: IconName; word: string }> = {
  bad: { icon: "cross", word: "Change" },
  look: { icon: "question", word: "Look" },
  good: { icon: "check", word: "Good" },
};

function Row({ finding }: { finding: FindingDoc }) {
  const { icon, word } = MARKS[finding.state];
  const { better, parameter } = finding;
  return (
    <li
      class={`check-row ${finding.state}`}
      data-testid="finding"
      data-state={finding.state}
      data-parameter={parameter}
    >
      <Icon name={icon} />
      <div>
        <p class="check-head">
          <strong>{parameter}</strong>
          <span class="check-word">{word}</span>
        </p>
        <p>{finding.text}</p>
        {better !== null && (
          <Button
            testid="set-it-so"
            disabled={outcomesPending.value || whyNotWrite.value !== null}
            title={whyNotWrite.value ?? `${parameter} is ${finding.value ?? "not known"} now`}
            onClick={() => void writeParameter(parameter, better)}
          >
            Set {parameter} to {finding.better_text}
          </Button>
        )}
      </div>
    </li>
  );
}

/** What the settings that matter close to the ground will do, worst first. */
export function LowFlight({ doc }: { doc: ParametersDoc }) {
  const bad = doc.findings.filter(({ state }) => state === "bad").length;
  return (
    <>
      <p data-testid="low-flight-about">
        {doc.plan_name
          ? `On the mission on board, ${doc.plan_name}:`
          : "No mission from here is on board: this is what holds for every low flight. Upload the plan to know more."}{" "}
        {doc.not_judged || (bad > 0 ? `${bad} to be changed before it.` : "nothing has to be changed.")}
      </p>
      {whyNotWrite.value && <p class="hint">{whyNotWrite.value}</p>}
      <ul class="check-rows">
        {doc.findings.map((finding) => (
          <Row key={finding.parameter + finding.text} finding={finding} />
        ))}
      </ul>
      <p class="hint">A setting that stands in no row was not looked at. Good is not a proof.</p>
    </>
  );
}
