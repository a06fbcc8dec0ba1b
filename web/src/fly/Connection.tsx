import { useState } from "preact/hooks";
import type { Candidate, ConnectionStatus, SigningStatus } from "../messages";
import { count, number } from "../format";
import { adopted, isInAir, lease, linkState, linkStatus, silence_s, vehicle } from "../store/flying";
import { pending } from "../store/outcomes";
import { failed, late_s, whyNotAsk, whyNotCommand, whyUnheard } from "../store/reach";
import { Button } from "../ui/Button";
import { HoldButton } from "../ui/HoldButton";
import { ErrorPanel } from "../ui/Outcome";
import { Icon } from "../ui/Icon";
import { Section } from "../ui/Section";
import {
  adopt,
  connectTo,
  disconnect,
  giveControl,
  release,
  setSigning,
  SIGNING,
  startSimulator,
} from "../vehicle/orders";
import { linkWords } from "../vehicle/vehicle_words";
import { hasAnotherWay } from "../vehicle/way_words";
import { WayTable } from "./WayTable";

const PLACE = "connection";

const EXAMPLES = [
  { address: "udpin:0.0.0.0:14550", note: "listen, as most radios send" },
  { address: "tcp:127.0.0.1:5760", note: "SITL, telemetry bridges" },
  { address: "/dev/ttyUSB0:57600", note: "telemetry radio" },
  { address: "/dev/ttyACM0:115200", note: "USB cable" },
];

const KINDS: Readonly<Record<number, string>> = {
  1: "plane",
  2: "quadrotor",
  3: "coaxial",
  4: "helicopter",
  13: "hexarotor",
  14: "octorotor",
  15: "tricopter",
};

const AUTOPILOTS: Readonly<Record<string, string>> = { ardupilot: "ArduPilot", px4: "PX4" };

const describe = (found: Candidate) =>
  `${AUTOPILOTS[found.autopilot] ?? "Unknown autopilot"} ${KINDS[found.vehicle_type] ?? "vehicle"}, system ${found.system_id}`;

/** With a vehicle in use it is another way to that one. */
function AddressForm() {
  const [address, setAddress] = useState("");
  const submit = (event: Event) => {
    event.preventDefault();
    if (address.trim()) void connectTo(address.trim(), adopted.value !== null);
  };
  return (
    <form class="address-form" onSubmit={submit}>
      <label class="field text">
        <span>Address</span>
        <input
          type="text"
          autocomplete="off"
          spellcheck={false}
          placeholder={EXAMPLES[0]?.address}
          value={address}
          data-testid="link-address"
          onInput={(event) => setAddress(event.currentTarget.value)}
        />
      </label>
      <ul class="examples" aria-label="Examples">
        {EXAMPLES.map((example) => (
          <li key={example.address}>
            <button type="button" class="link" onClick={() => setAddress(example.address)}>
              {example.address}
            </button>
            <span class="muted"> {example.note}</span>
          </li>
        ))}
      </ul>
      <button
        type="submit"
        class="button"
        disabled={whyNotCommand.value !== null || address.trim() === "" || pending.value.has(PLACE)}
        data-testid="link-connect"
      >
        <Icon name="plug" /> {pending.value.has(PLACE) ? "Connecting…" : "Connect"}
      </button>
    </form>
  );
}

const NOT_KNOWN = "not known now";
const STATES = { open: "open", waiting: "nothing heard yet", failed: "failed, tried again" } as const;

function ConnectionRow({ connection }: { connection: ConnectionStatus }) {
  const { address, state, error, received_messages, bad_bytes } = connection;
  const staysReached = hasAnotherWay(linkStatus.value?.status.ways ?? [], address);
  const isKnown = whyUnheard.value === null;
  return (
    <li data-testid="connection-row">
      <div class="row">
        <span class="connection-name">
          <strong>{address}</strong>
          <span class={isKnown && state === "failed" ? "says-bad" : "muted"}>
            {!isKnown
              ? NOT_KNOWN
              : state === "open"
                ? `${number(received_messages)} messages`
                : STATES[state]}
            {isKnown && bad_bytes > 0 && ` · ${number(bad_bytes)} bytes unreadable`}
          </span>
        </span>
        <Button
          kind="quiet"
          class="small"
          icon="cross"
          title={`Close ${address}`}
          disabled={whyNotCommand.value !== null || (isInAir.value && !staysReached)}
          testid="link-disconnect"
          onClick={() => void disconnect(address)}
        />
      </div>
      {error && <ErrorPanel error={error} />}
    </li>
  );
}

function Candidates({ found }: { found: readonly Candidate[] }) {
  if (found.length === 0) return null;
  return (
    <>
      <p class="hint">Heard, and nothing is sent to it until you use it:</p>
      <ul class="candidates">
        {found.map((candidate) => (
          <li class="row" key={candidate.id} data-testid="candidate-row">
            <span class="connection-name">
              <strong>{describe(candidate)}</strong>
              <span class="muted">{candidate.peer || candidate.address}</span>
            </span>
            <Button
              testid="adopt"
              disabled={whyNotCommand.value !== null || isInAir.value}
              onClick={() => void adopt(candidate.id)}
            >
              Use
            </Button>
          </li>
        ))}
      </ul>
    </>
  );
}

function Adopted({ used }: { used: Candidate }) {
  const firmware = vehicle.value?.firmware_version;
  return (
    <div class="row adopted" data-testid="adopted">
      <Icon name="drone" />
      <span class="connection-name">
        <strong>{describe(used)}</strong>
        <span class="muted">
          {firmware ? `${firmware} · ` : ""}
          {used.address}
        </span>
      </span>
      <Button
        kind="quiet"
        disabled={whyNotCommand.value !== null || isInAir.value}
        title={whyNotCommand.value ?? (isInAir.value ? "Not in the air" : "Send nothing to it any more")}
        testid="release"
        onClick={() => void release()}
      >
        Release
      </Button>
    </div>
  );
}

const SIGNED: Readonly<Record<SigningStatus["mode"], string>> = {
  off: "Not signed: whoever reaches the link can speak as the vehicle.",
  asked: "Key sent. The vehicle has not signed with it yet.",
  on: "Signed",
  let: "Switched off: unsigned messages are accepted.",
};

function Signing({ signing }: { signing: SigningStatus }) {
  const refused = signing.unsigned + signing.wrong + signing.replayed + signing.ahead;
  const isOn = signing.mode === "on";
  const isKnown = whyUnheard.value === null;
  return (
    <div class="row" data-testid="signing">
      <span class="connection-name">
        <strong>Signing</strong>
        <span class={isOn || !isKnown ? "muted" : "says-near"} data-testid="signing-state">
          {isKnown ? SIGNED[signing.mode] : NOT_KNOWN}
          {isKnown && refused > 0 && ` · ${number(refused)} refused`}
        </span>
        {isKnown && refused > 0 && (
          <span class="muted">
            {number(signing.unsigned)} unsigned, {number(signing.wrong)} with another key,{" "}
            {number(signing.replayed)} heard before, {number(signing.ahead)} of years ahead
          </span>
        )}
      </span>
      {isOn || signing.mode === "asked" ? (
        <HoldButton
          label="Switch off"
          icon="cross"
          place={SIGNING}
          disabled={whyNotCommand.value !== null}
          title="In an emergency: from then on anybody may speak as the vehicle"
          testid="signing-off"
          onHold={() => void setSigning(false)}
        />
      ) : (
        <HoldButton
          label="Set up"
          icon="check"
          place={SIGNING}
          disabled={whyNotCommand.value !== null || isInAir.value}
          title="Over a cable or a link that nobody else hears: the key is sent in the clear"
          testid="signing-on"
          onHold={() => void setSigning(true)}
        />
      )}
    </div>
  );
}

/** The simulator is the primary action below, until a connection waits for somebody. */
function NoVehicle({ waits }: { waits: boolean }) {
  return (
    <div class="no-vehicle" data-testid="no-vehicle">
      <p>Connect a vehicle, or try everything with a simulated one over the open plan.</p>
      {waits && (
        <Button
          icon="drone"
          testid="start-simulator"
          disabled={pending.value.has(PLACE) || whyNotCommand.value !== null}
          onClick={() => void startSimulator(PLACE)}
        >
          Start the simulator
        </Button>
      )}
    </div>
  );
}

/** How to reach a vehicle, which one is commanded, and what is wrong with the way to it. */
export function ConnectionSection() {
  const status = linkStatus.value?.status ?? null;
  const used = adopted.value;
  const summary = used
    ? linkWords(status, silence_s.value, linkState.value, failed.value, late_s.value).text
    : whyUnheard.value === null
      ? count(status?.candidates.length ?? 0, "vehicle") + " heard"
      : NOT_KNOWN;
  return (
    <Section
      id={PLACE}
      title="Connection"
      icon="plug"
      summary={status || used ? summary : "no vehicle"}
      startsOpen={!used}
    >
      {used ? <Adopted used={used} /> : <NoVehicle waits={Boolean(status?.connections.length)} />}
      {used && status && <WayTable ways={status.ways} />}
      {used && status && <Signing signing={status.signing} />}
      <Candidates found={status?.candidates ?? []} />
      {status && status.connections.length > 0 && (
        <ul class="connections" aria-label="Connections">
          {status.connections.map((connection) => (
            <ConnectionRow key={connection.address} connection={connection} />
          ))}
        </ul>
      )}
      {used ? (
        <details class="details">
          <summary>Another way to the vehicle…</summary>
          <AddressForm />
        </details>
      ) : (
        <AddressForm />
      )}
      {lease.value.mine && used && (
        <button
          type="button"
          class="link"
          disabled={whyNotAsk.value !== null}
          data-testid="give-control"
          onClick={() => void giveControl()}
        >
          Let go of control
        </button>
      )}
    </Section>
  );
}
