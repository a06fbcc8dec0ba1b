import type { WayStatus } from "../messages";
import { linkStatus } from "../store/flying";
import { now_ms } from "../store/clock";
import { whyUnheard } from "../store/reach";
import { Icon } from "../ui/Icon";
import { ageWord, lossWord, roundTripWord, signalTitle, signalWord } from "../vehicle/way_words";

/** Its address has a line to itself: it is longer than all its figures together. */
function Way({ way, told_s }: { way: WayStatus; told_s: number }) {
  return (
    <tbody data-testid="way-row" data-in-use={way.in_use}>
      <tr>
        <th scope="rowgroup" colSpan={4}>
          <span class={way.in_use ? "way-mark" : "way-mark hidden"} title="In use: orders go over it">
            <Icon name="check" size={14} />
          </span>
          {way.address}
        </th>
      </tr>
      {way.identity === "asked" ? (
        <tr>
          <td colSpan={4} class="muted">
            Checking whether it is the same vehicle…
          </td>
        </tr>
      ) : (
        <tr>
          <td>{lossWord(way)}</td>
          <td>{roundTripWord(way)}</td>
          <td>{ageWord(way, told_s)}</td>
          <td title={signalTitle(way)}>{signalWord(way)}</td>
        </tr>
      )}
    </tbody>
  );
}

/** Each way to the vehicle beside the others; nothing when there is one alone: the strip has its figures. */
export function WayTable({ ways }: { ways: readonly WayStatus[] }) {
  if (ways.length < 2 || whyUnheard.value !== null) return null;
  const told_s = Math.max(0, now_ms.value - (linkStatus.value?.received_ms ?? now_ms.value)) / 1000;
  return (
    <div class="way-table">
      <table aria-label="Ways to the vehicle" data-testid="ways">
        <thead>
          <tr>
            <th scope="col">Lost</th>
            <th scope="col">Round trip</th>
            <th scope="col">Age</th>
            <th scope="col">Signal</th>
          </tr>
        </thead>
        {ways.map((way) => (
          <Way key={way.address} way={way} told_s={told_s} />
        ))}
      </table>
    </div>
  );
}
