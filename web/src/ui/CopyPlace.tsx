import { useState } from "preact/hooks";
import { latLon } from "../format";
import type { PlaceDoc } from "../messages";
import { Button } from "./Button";
import { notifyText } from "../store/state";

/** Copies latitude and longitude with all 7 decimals. */
export function CopyPlace({ place, name }: { place: PlaceDoc; name: string }) {
  const [copied, setCopied] = useState(false);
  const copy = async (event: MouseEvent) => {
    event.stopPropagation();
    try {
      await navigator.clipboard.writeText(latLon(place));
      setCopied(true);
      setTimeout(() => setCopied(false), 1500);
    } catch {
      notifyText("warning", "The browser does not let this page copy.", `Copy by hand: ${latLon(place)}`);
    }
  };
  const title = copied ? "Copied" : `Copy latitude and longitude of ${name}`;
  return <Button kind="quiet" class="small" icon={copied ? "check" : "copy"} title={title} onClick={copy} />;
}
