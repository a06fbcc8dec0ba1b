import { clearance, metres, withUnit } from "../format";
import type { ManoeuvreDoc } from "../messages";
import { alerts, obstacles } from "../store/obstacles";
import { whyNotCommand } from "../store/reach";
import { HoldButton } from "../ui/HoldButton";
import { Icon, type IconName } from "../ui/Icon";
import { matching } from "../ui/media";
import { Outcome } from "../ui/Outcome";
import { MANOEUVRE, flyManoeuvre } from "./obstacle_orders";
import { cardsFor, sidestepWords, type Card, type Kind } from "./manoeuvres";

interface Words {
  title: string;
  action: string;
  icon: IconName;
}

const WORDS: Record<Kind, Words> = {
  over: { title: "Over it", action: "Fly over", icon: "up" },
  around: { title: "Around it", action: "Fly around", icon: "redo" },
  sidestep: { title: "Sidestep", action: "Sidestep", icon: "sidestep" },
};

/** Out of the way of what moves: level, so what it does says more than how high it climbs. */
function SidestepFacts({ doc }: { doc: ManoeuvreDoc }) {
  const { does, detail } = sidestepWords(doc.text);
  return (
    <>
      <p class="sidestep-does" title={doc.text} data-testid="sidestep-does">
        <strong>{does}</strong>
        {detail && <span>{detail}</span>}
      </p>
      <dl class="manoeuvre-facts">
        <dt>Clear by</dt>
        <dd data-testid={`clearance-${doc.kind}`}>{clearance(doc.clearance_m)}</dd>
        <dt class="visually-hidden">Takes</dt>
        <dd>{withUnit(doc.seconds, "s")}</dd>
      </dl>
    </>
  );
}

function Facts({ doc }: { doc: ManoeuvreDoc }) {
  if (doc.kind === "sidestep") return <SidestepFacts doc={doc} />;
  return (
    <dl class="manoeuvre-facts">
      <dt>{doc.top_unseen ? "Its top" : "Clear by"}</dt>
      <dd data-testid={`clearance-${doc.kind}`}>
        {doc.top_unseen ? "not seen" : clearance(doc.clearance_m)}
      </dd>
      <dt>Climb</dt>
      <dd>{metres(doc.climb_m)}</dd>
      <dt>Takes</dt>
      <dd>{withUnit(doc.seconds, "s")}</dd>
    </dl>
  );
}

function ManoeuvreCard({ card }: { card: Card }) {
  const { kind, doc } = card;
  const { title, action, icon } = WORDS[kind];
  const why = whyNotCommand.value;
  const isPossible = doc?.possible ?? false;
  return (
    <li
      class={`manoeuvre ${kind} ${isPossible ? "" : "impossible"}`}
      data-testid={`manoeuvre-${kind}`}
      data-possible={isPossible}
    >
      <strong>
        <Icon name={icon} size={16} /> {title}
      </strong>
      {doc?.possible ? <Facts doc={doc} /> : <p class="muted">{doc ? doc.text : "Looking for it…"}</p>}
      {doc?.possible && (
        <HoldButton
          wide
          label={action}
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

/** As in `layout.css`: from this width on the left panel, where everything is commanded from, is always there. */
export const standLeft = matching("(min-width: 1100px)");

/** The ways past what calls first, as drawn in the 3D view; never below it. */
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
