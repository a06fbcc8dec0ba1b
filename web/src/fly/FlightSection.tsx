import { bytes, duration } from "../format";
import { adopted, flight, isInAir, recorded_s, recorder, vehicle } from "../store/flying";
import { pending } from "../store/outcomes";
import { failed, whyNotAsk, whyNotCommand, whyUnheard } from "../store/reach";
import { Button } from "../ui/Button";
import { Done, ErrorPanel, Outcome } from "../ui/Outcome";
import { HoldButton } from "../ui/HoldButton";
import { Section } from "../ui/Section";
import { EmergencyStop } from "./EmergencyStop";
import { arm, disarm, land, startRecording, stopRecording } from "../vehicle/orders";
import { armedWord } from "../vehicle/vehicle_words";

const PLACE = "flight";

function Actions() {
  const state = vehicle.value;
  const why = whyNotCommand.value;
  return (
    <div class="row wrap minor-actions">
      {state?.armed ? (
        <>
          <HoldButton
            place={PLACE}
            label="Land"
            icon="land"
            disabled={why !== null || !isInAir.value}
            title={why ?? "Come down here and now"}
            testid="land"
            onHold={() => void land()}
          />
          <HoldButton
            place={PLACE}
            label="Disarm"
            icon="power"
            disabled={why !== null || isInAir.value}
            title={why ?? (isInAir.value ? "Only on the ground" : "Stop the motors")}
            testid="disarm"
            onHold={() => void disarm()}
          />
        </>
      ) : (
        <HoldButton
          place={PLACE}
          label="Arm"
          icon="power"
          disabled={why !== null}
          title={why ?? "Switch the motors on; Start does it by itself"}
          testid="arm"
          onHold={() => void arm()}
        />
      )}
    </div>
  );
}

function Recorder() {
  const status = recorder.value?.status;
  const word = status?.recording ? `Recording ${duration(recorded_s.value)}` : "Not recording";
  const isUnheard = failed.value === "server";
  return (
    <div class="recorder">
      <div class="row">
        <span class="connection-name">
          <strong>{isUnheard ? "Recording: not known" : word}</strong>
          <span class="muted">
            {status?.recording
              ? `${status.name ?? ""} · ${bytes(status.bytes)}`
              : "Starts by itself on arming"}
          </span>
        </span>
        <Button
          disabled={whyNotAsk.value !== null || pending.value.has("recorder")}
          testid={status?.recording ? "record-stop" : "record-start"}
          onClick={() => void (status?.recording ? stopRecording() : startRecording())}
        >
          {status?.recording ? "Stop" : "Record"}
        </Button>
      </div>
      {status?.error && <ErrorPanel error={status.error} />}
      <Outcome place="recorder" />
    </div>
  );
}

/** What is seldom needed while flying by plan, and the recorder. */
export function FlightSection() {
  if (!adopted.value) return null;
  const phase = flight.live.value?.phase ?? "idle";
  const word = phase === "interrupted" ? "broken off" : armedWord(vehicle.value).toLowerCase();
  return (
    <Section
      id={PLACE}
      title="Vehicle"
      icon="drone"
      summary={whyUnheard.value ? "not known now" : word}
      startsOpen
    >
      <Actions />
      <EmergencyStop />
      <Done place={PLACE} />
      <Recorder />
    </Section>
  );
}
