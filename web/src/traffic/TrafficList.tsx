import { signal } from "@preact/signals";
import { DASH, degreesOf, withUnit } from "../format";
import type { Aircraft, TrafficStatus } from "../messages";
import { heard, type Source } from "../store/flying";
import { hasTraffic, isSilent, sinceTold_s, traffic } from "../store/traffic";
import { Icon } from "../ui/Icon";
import { OLD_S, SOURCE_WORDS, aircraftWords, away, closing, height, leftOut } from "./traffic_words";

/** The aircraft whose figures stand below the rows; empty: the first. */
const chosen = signal("");

/** So many rows always, filled or not: nothing below moves. */
const ROWS = 3;

/** Where it is, seen from the nose. */
function Where({ bearing_deg, heading_deg }: { bearing_deg: number | null; heading_deg: number | null }) {
  const turn_deg = bearing_deg === null || heading_deg === null ? null : bearing_deg - heading_deg;
  return (
    <svg class="track-bearing" viewBox="-8 -8 16 16" width="16" height="16" aria-hidden="true">
      {turn_deg === null ? (
        <circle r={2.5} />
      ) : (
        <path d="M0-7 5 6 0 3-5 6z" transform={`rotate(${turn_deg.toFixed(0)})`} />
      )}
    </svg>
  );
}

interface RowProps {
  it: Aircraft;
  heading_deg: number | null;
  more_s: number;
  isChosen: boolean;
}

function Row({ it, heading_deg, more_s, isChosen }: RowProps) {
  const age_s = it.age_s + more_s;
  const isOld = age_s > OLD_S;
  const small = isOld ? `${withUnit(age_s, "s")} old` : it.kind || SOURCE_WORDS[it.source];
  return (
    <li
      class={`${it.conflict ? "dangerous" : ""} ${isOld ? "old" : ""}`}
      data-testid="traffic-row"
      data-key={it.key}
    >
      <button
        type="button"
        aria-pressed={isChosen}
        title={`All that is known of ${it.name}`}
        onClick={() => (chosen.value = it.key)}
      >
        <span class="traffic-name">
          {(it.conflict || it.emergency) && <Icon name="warning" size={14} />}
          <strong>{it.name}</strong>
          <small class="muted">{it.trust === "echo" ? "your own?" : small}</small>
        </span>
        <span class="number">
          <Where bearing_deg={it.bearing_deg} heading_deg={heading_deg} /> {away(it.distance_m)}
        </span>
        <span class={it.height_m === null ? "muted" : "number"}>
          {it.height_m === null ? "height ?" : height(it)}
        </span>
        <span class={it.conflict ? "" : "muted"}>{it.on_ground ? "on ground" : closing(it)}</span>
      </button>
    </li>
  );
}

const Empty = () => (
  <li class="empty" aria-hidden="true">
    {DASH}
  </li>
);

/** Below the rows: what is wrong first, then what is known of the chosen one. */
function note(status: TrafficStatus, silent: boolean, words: string): string {
  if (silent) return "Nothing new is heard of traffic: the link may have failed. Look out.";
  return status.text || words || "No other aircraft is heard within the set distance and height.";
}

/** Other aircraft, who may come too near first: name, distance, height difference, whether it is closing. */
export function TrafficList({ source }: { source: Source }) {
  const known = traffic[source].value;
  const status = known?.status;
  if (!hasTraffic[source].value || !known || !status) return null;
  const silent = isSilent(known, source);
  const more_s = sinceTold_s(known, source);
  const heading_rad = heard[source].value?.message.state?.heading_rad ?? null;
  const heading_deg = heading_rad === null ? null : degreesOf(heading_rad);
  const picked = status.aircraft.find((it) => it.key === chosen.value) ?? status.aircraft[0];
  const top = status.aircraft.slice(0, ROWS);
  const shown = picked && !top.includes(picked) ? [...top.slice(0, ROWS - 1), picked] : top;
  const words = picked ? aircraftWords(picked, heading_deg, more_s) : "";
  return (
    <section class="instrument tracks traffic" aria-label="Traffic" data-testid={`traffic-${source}`}>
      <h2>
        Traffic{" "}
        <span class={silent || status.state !== "watching" ? "bad" : "muted"}>
          {silent ? "silent" : status.state === "watching" ? "" : "own position unknown"}
        </span>
      </h2>
      <ul class={`traffic-rows ${silent ? "stale" : ""}`}>
        {shown.map((it) => (
          <Row key={it.key} it={it} heading_deg={heading_deg} more_s={more_s} isChosen={it === picked} />
        ))}
        {Array.from({ length: ROWS - shown.length }, (_, index) => (
          <Empty key={`empty-${index}`} />
        ))}
      </ul>
      <p class="tracks-note traffic-note" data-testid="traffic-note">
        {note(status, silent, words)} {leftOut(status, shown.length)}
      </p>
    </section>
  );
}
