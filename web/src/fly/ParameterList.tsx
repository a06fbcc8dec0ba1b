import { useState } from "preact/hooks";
import type { ComparedDoc, ParameterDoc, ParametersDoc } from "../messages";
import { asSet } from "../format";
import { checkValue, compared, found, outside, writeParameter } from "../store/parameters";
import { Button } from "../ui/Button";
import { Check, TextField } from "../ui/fields";
import { outcomesPending, whyNotWrite } from "./parameter_writing";

/** More rows than anyone reads would only make the page slow: the search finds the others. */
const MOST_ROWS = 200;

function Edit({ one, onDone }: { one: ParameterDoc; onDone: () => void }) {
  const [text, setText] = useState(one.value === null ? "" : one.text);
  const value = checkValue(one, text);
  const isNumber = typeof value === "number";
  const note = isNumber ? outside(one, value) : value;
  return (
    <div class="parameter-edit">
      {one.help && <p>{one.help}</p>}
      {one.default !== null && <p class="muted">{`Default ${one.default} ${one.unit}`.trim()}</p>}
      <TextField
        label={`New value of ${one.name}${one.unit && `, ${one.unit}`}`}
        value={text}
        testid="parameter-value"
        onChange={setText}
      />
      {note && <p class={isNumber ? "hint" : "problem"}>{note}</p>}
      {one.reboot && <p class="hint">It counts from the vehicle's next start on.</p>}
      <div class="row">
        <Button
          kind="primary"
          testid="parameter-write"
          disabled={!isNumber || outcomesPending.value || whyNotWrite.value !== null}
          title={whyNotWrite.value ?? ""}
          onClick={() => {
            if (isNumber) void writeParameter(one.name, value).then(onDone);
          }}
        >
          Write and read back
        </Button>
        <Button kind="quiet" onClick={onDone}>
          Leave it
        </Button>
      </div>
      {whyNotWrite.value && <p class="hint">{whyNotWrite.value}</p>}
    </div>
  );
}

function Row({ one }: { one: ParameterDoc }) {
  const [open, setOpen] = useState(false);
  return (
    <li class="parameter" data-testid="parameter" data-name={one.name}>
      <button type="button" class="parameter-head" aria-expanded={open} onClick={() => setOpen(!open)}>
        <span class="parameter-name">{one.name}</span>
        <span class="parameter-value number">
          {one.text} {one.unit}
        </span>
        <span class="muted parameter-title">
          {[one.meaning, one.title, one.changed ? "changed" : ""].filter(Boolean).join(" · ")}
        </span>
      </button>
      {open && <Edit one={one} onDone={() => setOpen(false)} />}
    </li>
  );
}

function Compared({ made }: { made: ComparedDoc }) {
  const known = made.differences.filter((one) => one.here !== null && one.there !== null);
  const others = made.differences.length - known.length;
  return (
    <section class="compared" data-testid="compared">
      <p>
        <strong>{made.file}</strong>: {made.same} the same, {known.length} different, {others} in one of both
        only. {made.notes.join(" ")}
      </p>
      <ul>
        {made.differences.slice(0, MOST_ROWS).map(({ name, here, there, own }) => (
          <li key={name} class="row wrap">
            <strong>{name}</strong>
            <span>
              vehicle {here === null ? "has none" : asSet(here)}, {made.is_vehicle ? "the other" : "file"}{" "}
              {there === null ? "has none" : asSet(there)}
            </span>
            {own && <span class="muted">of one vehicle alone</span>}
            {here !== null && there !== null && !own && (
              <Button
                class="small"
                disabled={outcomesPending.value || whyNotWrite.value !== null}
                title={whyNotWrite.value ?? ""}
                onClick={() => void writeParameter(name, there)}
              >
                Write {asSet(there)}
              </Button>
            )}
          </li>
        ))}
      </ul>
    </section>
  );
}

export function ParameterList({ doc }: { doc: ParametersDoc }) {
  const [text, setText] = useState("");
  const [changed, setChanged] = useState(false);
  const rows = found(doc.parameters, text, changed);
  const hasDefaults = doc.parameters.some((one) => one.default !== null);
  return (
    <>
      {compared.value && <Compared made={compared.value} />}
      <input
        type="search"
        class="parameter-search"
        aria-label="Search names and descriptions"
        placeholder="Search names and descriptions"
        data-testid="parameter-search"
        value={text}
        onInput={(event) => setText(event.currentTarget.value)}
      />
      {hasDefaults && (
        <Check label="Only what differs from its default" checked={changed} onChange={setChanged} />
      )}
      {!doc.described && (
        <p class="hint">Units, ranges and help are not known: give the makers' file with Units and help.</p>
      )}
      <ul class="parameter-list">
        {rows.slice(0, MOST_ROWS).map((one) => (
          <Row key={one.name} one={one} />
        ))}
      </ul>
      {rows.length === 0 && <p class="muted">No such parameter.</p>}
      {rows.length > MOST_ROWS && <p class="muted">{rows.length - MOST_ROWS} more: search for them.</p>}
    </>
  );
}
