import type { WayStatus } from "../messages";
import { linkStatus } from "../store/flying";
import { now_ms } from "../store/clock";
import { whyUnheard } from "../store/reach";
import { Icon } from "../ui/Icon";
import { ageWord, lossWord, roundTripWord, signalTitle, signalWord } from "../vehicle/way_words";

function Row({ way, told_s }: { way: WayStatus; told_s: number }) {
  return (
    <tr data-testid="way-row" data-in-use={way.in_use}>
      <th scope="row">
        <span class={way.in_use ? "way-mark" : "way-mark hidden"} title="In use: orders go over it">
          <Icon name="check" />
        </span>
        {way.address}
      </th>
      {way.identity === "asked" ? (
        <td colSpan={4} class="muted">
          Checking whether it is the same vehicle…
        </td>
      ) : (
        <>
          <td>{lossWord(way)}</td>
          <td>{roundTripWord(way)}</td>
          <td>{ageWord(way, told_s)}</td>
          <td title={signalTitle(way)}>{signalWord(way)}</td>
        </>
      )}
    </tr>
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
            <th scope="col">Way</th>
            <th scope="col">Lost</th>
            <th scope="col">There and back</th>
            <th scope="col">Age</th>
            <th scope="col">Signal</th>
          </tr>
        </thead>
        <tbody>
          {ways.map((way) => (
            <Row key={way.address} way={way} told_s={told_s} />
          ))}
        </tbody>
      </table>
    </div>
  );
}
