import { clearance, metres, withUnit } from "../format";
import type { ManoeuvreDoc } from "../messages";
import { lease } from "../store/flying";
import { alerts, obstacles } from "../store/obstacles";
import { link } from "../store/state";
import { HoldButton } from "../ui/HoldButton";
import { Icon } from "../ui/Icon";
import { Outcome } from "../ui/Outcome";
import { MANOEUVRE, flyManoeuvre } from "./commands";
import { cardsFor, type Card } from "./manoeuvres";

const TITLES = { over: "Over it", around: "Around it" } as const;
const ICONS = { over: "up", around: "redo" } as const;

/** Why nothing can be commanded from here now. */
function obstacleToFlying(): string | null {
  if (link.value === "lost") return "The server cannot be reached";
  return lease.value.mine ? null : "You observe: take control first";
}

function Facts({ doc }: { doc: ManoeuvreDoc }) {
  return (
    <dl class="manoeuvre-facts">
      <dt>Clear by</dt>
      <dd data-testid={`clearance-${doc.kind}`}>{clearance(doc.clearance_m)}</dd>
      <dt>Climb</dt>
      <dd>{metres(doc.climb_m)}</dd>
      <dt>Takes</dt>
      <dd>{withUnit(doc.seconds, "s")}</dd>
    </dl>
  );
}

function ManoeuvreCard({ card }: { card: Card }) {
  const { kind, doc } = card;
  const why = obstacleToFlying();
  const isPossible = doc?.possible ?? false;
  return (
    <li
      class={`manoeuvre ${isPossible ? "" : "impossible"}`}
      data-testid={`manoeuvre-${kind}`}
      data-possible={isPossible}
    >
      <strong>
        <Icon name={ICONS[kind]} size={16} /> {TITLES[kind]}
      </strong>
      {doc?.possible ? <Facts doc={doc} /> : <p class="muted">{doc ? doc.text : "Looking for it…"}</p>}
      {doc?.possible && (
        <HoldButton
          wide
          label={kind === "over" ? "Fly over" : "Fly around"}
          icon="play"
          place={MANOEUVRE}
          disabled={why !== null}
          title={why ?? doc.text}
          testid={`fly-${kind}`}
          onHold={() => void flyManoeuvre(doc.id, kind)}
        />
      )}
    </li>
  );
}

/** Two ways past the obstacle that calls first, as drawn in the 3D view; never below it. */
export function Manoeuvres() {
  const cards = cardsFor(alerts.live.value, obstacles.live.value);
  return (
    <>
      {cards && (
        <section class="manoeuvres" aria-label="Ways past the obstacle" data-testid="manoeuvres">
          <ul>
            {cards.map((card) => (
              <ManoeuvreCard key={card.kind} card={card} />
            ))}
          </ul>
        </section>
      )}
      <Outcome place={MANOEUVRE} />
    </>
  );
}
