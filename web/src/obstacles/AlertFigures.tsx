import { useState } from "preact/hooks";
import { clock, latLon, metres } from "../format";
import type { AlertDoc, Obstacle } from "../messages";
import { notifyText } from "../store/state";
import { Icon } from "../ui/Icon";
import { bearingWord, distance, heightDifference, seenAgo, timeTo } from "./obstacle_words";

/** Where it is; before the first position of the vehicle nobody knows. */
export function Place({ obstacle: { lat_deg, lon_deg, alt_amsl_m } }: { obstacle: Obstacle }) {
  if (lat_deg === null || lon_deg === null) {
    return <span class="alert-place muted">Place unknown: no position of the vehicle yet</span>;
  }
  return <Copied text={latLon({ lat_deg, lon_deg })} alt_amsl_m={alt_amsl_m} />;
}

/** The place as text that a click copies, all 7 decimals of it. */
function Copied({ text, alt_amsl_m }: { text: string; alt_amsl_m: number | null }) {
  const [copied, setCopied] = useState(false);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      setCopied(true);
      setTimeout(() => setCopied(false), 1500);
    } catch {
      notifyText("warning", "The browser does not let this page copy.", `Copy by hand: ${text}`);
    }
  };
  return (
    <button
      type="button"
      class="alert-place"
      title="Copy latitude and longitude"
      data-testid="alert-place"
      onClick={copy}
    >
      <Icon name={copied ? "check" : "copy"} size={16} />
      <span class="number">{text}</span>
      <span class="muted number">{metres(alt_amsl_m)} AMSL</span>
      {copied && <span class="visually-hidden">Copied</span>}
    </button>
  );
}

interface FiguresProps {
  obstacle: Obstacle;
  isOver: boolean;
  /** How old these are; null: they are of now. */
  late_s: number | null;
}

function when({ obstacle, isOver, late_s }: FiguresProps): string {
  if (isOver) return "when last seen";
  return late_s === null ? timeTo(obstacle.time_to_contact_s) : `seen ${seenAgo(late_s)}`;
}

/** What is over is told as it was last seen: nobody has to brake for it. What is not told again stays, with its age. */
export function Figures(props: FiguresProps) {
  const { obstacle, isOver, late_s } = props;
  return (
    <p class={`alert-figures ${isOver ? "over" : ""}`}>
      <strong class="alert-distance" data-testid="alert-distance">
        {distance(obstacle.distance_m)}
      </strong>
      <span>{bearingWord(obstacle)}</span>
      <span>{heightDifference(obstacle.height_difference_m)}</span>
      <span
        class={isOver || (late_s === null && obstacle.time_to_contact_s === null) ? "muted" : ""}
        data-testid="alert-when"
      >
        {when(props)}
      </span>
    </p>
  );
}

const began = (entry: AlertDoc) => clock(entry.began_utc_s);

export function State({ entry }: { entry: AlertDoc }) {
  const ended = clock(entry.alert.t_utc_s);
  if (entry.over)
    return (
      <span class="alert-state" data-testid="alert-over">
        <b>OVER</b> since {ended}
      </span>
    );
  return <span class="alert-state">since {began(entry)}</span>;
}
