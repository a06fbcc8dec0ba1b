import { Avoidance } from "../obstacles/Avoidance";
import { Manoeuvres } from "../obstacles/Manoeuvres";
import { AheadLine, MissionAhead } from "../obstacles/MissionAhead";
import { Sensors } from "../obstacles/Sensors";
import { adopted, heard, texts } from "../store/flying";
import { hasSensors } from "../store/obstacles";
import { Instruments } from "./Instruments";
import { VehicleMessages } from "./VehicleMessages";

function Teaching() {
  return (
    <div class="teaching">
      <p>Attitude, heights, speeds and the way home appear here as soon as a vehicle is connected.</p>
      <p>Every height says what it counts from; every value that is old says how old.</p>
    </div>
  );
}

/** At the lower edge, where nothing moves when an obstacle appears: the ways past it, and avoidance. */
function Evasion() {
  if (!adopted.value || !hasSensors.live.value) return null;
  return (
    <footer class="evasion">
      <AheadLine />
      <Manoeuvres />
      <Avoidance />
    </footer>
  );
}

/** What is true about the vehicle and what is around it. */
export function FlyRight() {
  const isEmpty = adopted.value === null && heard.live.value === null;
  return (
    <>
      <div class="panel-scroll truth" tabIndex={0}>
        {isEmpty ? <Teaching /> : <Instruments source="live" />}
        <MissionAhead source="live" />
        <Sensors source="live" />
        {(!isEmpty || texts.value.length > 0) && <VehicleMessages />}
      </div>
      <Evasion />
    </>
  );
}
