import { useEffect, useState } from "preact/hooks";
import { bytes, count, duration, number } from "../format";
import type { BagDoc, BagRecordingBody, BagTopicDoc } from "../messages";
import { BAGS, bags, loadBags, making, putAway, recordBag } from "../store/bags";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ErrorBox } from "../ui/Outcome";
import { Section } from "../ui/Section";
import { SelectField } from "../ui/fields";

const KINDS = {
  ros1: "ROS 1",
  folder: "ROS 2, folder",
  mcap: "ROS 2, MCAP",
  db3: "ROS 2, SQLite",
} as const;

const SENSORS = [
  { value: "radar", label: "radar: few targets" },
  { value: "vision", label: "camera or lidar: dense clouds" },
  { value: "ranges", label: "range finder" },
] as const;

const readable = (bag: BagDoc, ...roles: BagTopicDoc["role"][]) =>
  bag.topics.filter(({ role, messages }) => roles.includes(role) && messages > 0);

const option = ({ name, messages }: BagTopicDoc) => ({ value: name, label: `${name} (${number(messages)})` });

const shortType = (type: string) => type.split("/").at(-1) ?? type;

/** Of a field of numbers: its text is one, or empty. */
const given = (text: string) => (text === "" ? null : Number(text));

function Topics({ topics }: { topics: readonly BagTopicDoc[] }) {
  return (
    <details class="details">
      <summary>{count(topics.length, "topic")}</summary>
      <dl class="facts-list" data-testid="bag-topics">
        {topics.map((topic) => (
          <>
            <dt title={topic.type}>{shortType(topic.type)}</dt>
            <dd>
              {topic.name}: {number(topic.messages)}
              {topic.span_s !== null && ` in ${duration(topic.span_s)}`}
            </dd>
          </>
        ))}
      </dl>
    </details>
  );
}

/** A number that may be left out. */
function Given(props: {
  label: string;
  value: string;
  testid: string;
  required?: boolean;
  range: [number, number];
  onChange: (value: string) => void;
}) {
  return (
    <label class="field">
      <span>{props.label}</span>
      <input
        type="number"
        step="any"
        min={props.range[0]}
        max={props.range[1]}
        required={props.required}
        value={props.value}
        data-testid={props.testid}
        onInput={(event) => props.onChange(event.currentTarget.value)}
      />
    </label>
  );
}

/** What of a bag is to be flown again, and where on Earth that was. */
function Ask({ bag }: { bag: BagDoc }) {
  const points = readable(bag, "points");
  const hasFix = readable(bag, "fix").length > 0;
  const [draft, setDraft] = useState({
    points: points[0]?.name ?? "",
    pose: "",
    sensor: "vision" as BagRecordingBody["sensor"] & string,
    frame: "",
    lat: "",
    lon: "",
    alt: "",
    gap: "0.5",
  });
  const set = (fields: Partial<typeof draft>) => setDraft({ ...draft, ...fields });
  const isBusy = making.value.has(bag.id);
  const submit = (event: Event) => {
    event.preventDefault();
    if (draft.alt === "" || draft.gap === "") return; // the browser asks for both
    void recordBag(bag, {
      points: draft.points,
      pose: draft.pose || null,
      frame: draft.frame.trim() || null,
      sensor: draft.sensor,
      max_gap_s: Number(draft.gap),
      home_lat_deg: given(draft.lat),
      home_lon_deg: given(draft.lon),
      home_alt_amsl_m: Number(draft.alt),
    });
  };
  return (
    <form class="hint-form" data-testid="bag-form" onSubmit={submit}>
      <SelectField
        label="Points"
        value={draft.points}
        options={points.map(option)}
        testid="bag-points"
        onChange={(topic) => set({ points: topic })}
      />
      <SelectField
        label="Poses"
        value={draft.pose}
        options={[
          { value: "", label: "the only ones, else transforms" },
          ...readable(bag, "poses", "transforms").map(option),
        ]}
        testid="bag-pose"
        onChange={(pose) => set({ pose })}
      />
      <SelectField
        label="Taken as"
        value={draft.sensor}
        options={SENSORS}
        testid="bag-sensor"
        onChange={(sensor) => set({ sensor })}
      />
      <label class="field text">
        <span>Robot's frame</span>
        <input
          type="text"
          maxLength={256}
          placeholder="as its poses say"
          value={draft.frame}
          data-testid="bag-frame"
          onInput={(event) => set({ frame: event.currentTarget.value })}
        />
      </label>
      <Given
        label="Gaps bridged, s"
        value={draft.gap}
        testid="bag-gap"
        required
        range={[0.01, 60]}
        onChange={(gap) => set({ gap })}
      />
      <p class="hint">First pose: {hasFix ? "by NavSatFix where latitude is empty" : "where on Earth"}</p>
      <Given
        label="Latitude, °"
        value={draft.lat}
        testid="bag-lat"
        required={!hasFix}
        range={[-90, 90]}
        onChange={(lat) => set({ lat })}
      />
      <Given
        label="Longitude, °"
        value={draft.lon}
        testid="bag-lon"
        required={!hasFix}
        range={[-180, 180]}
        onChange={(lon) => set({ lon })}
      />
      <Given
        label="Above sea level, m"
        value={draft.alt}
        testid="bag-alt"
        required
        range={[-500, 9000]}
        onChange={(alt) => set({ alt })}
      />
      <div class="row">
        <button type="submit" class="button accent" disabled={isBusy} data-testid="bag-record">
          Make a recording
        </button>
        {isBusy && <span class="spinner" aria-hidden="true" />}
      </div>
    </form>
  );
}

function Bag({ bag }: { bag: BagDoc }) {
  return (
    <div data-testid="bag">
      <div class="row">
        <strong class="name" title={bag.name}>
          {bag.name}
        </strong>
        <span class="muted">
          {KINDS[bag.kind]}, {bytes(bag.bytes)}
        </span>
        <Button
          kind="quiet"
          class="small"
          icon="cross"
          title={`Put ${bag.name} away`}
          disabled={making.value.has(bag.id)}
          testid="bag-away"
          onClick={() => void putAway(bag)}
        />
      </div>
      <Topics topics={bag.topics} />
      {bag.missing.map((what) => (
        <p class="callout" key={what} data-testid="bag-missing">
          <Icon name="warning" /> {what}
        </p>
      ))}
      {readable(bag, "points").length > 0 && readable(bag, "poses", "transforms").length > 0 && (
        <Ask bag={bag} />
      )}
    </div>
  );
}

/** Bags of ROS that the station keeps, until they are put away. */
export function Bags() {
  useEffect(() => void loadBags(), []);
  if (bags.value.length === 0) return <ErrorBox place={BAGS} />;
  return (
    <Section id="bags" title="ROS bags" icon="folder" summary={count(bags.value.length, "bag")} startsOpen>
      <ErrorBox place={BAGS} />
      {bags.value.map((bag) => (
        <Bag key={bag.id} bag={bag} />
      ))}
    </Section>
  );
}
