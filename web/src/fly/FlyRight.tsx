import { Changes } from "../ui/Changes";
import { Avoidance } from "../obstacles/Avoidance";
import { AheadLine, MissionAhead } from "../obstacles/MissionAhead";
import { Looking } from "../obstacles/Looking";
import { Sensors } from "../obstacles/Sensors";
import { hasRoom } from "../tracks/Displays";
import { ROWS, TrackList } from "../tracks/TrackList";
import { TrafficList } from "../traffic/TrafficList";
import { adopted, heard, texts } from "../store/flying";
import { hasSensors } from "../store/obstacles";
import { Health } from "../vehicle/Health";
import { Instruments } from "../vehicle/Instruments";
import { VehicleMessages } from "./VehicleMessages";

function Teaching() {
  return (
    <div class="teaching">
      <p>Attitude, heights, speeds and the way home appear here as soon as a vehicle is connected.</p>
      <p>Every height says what it counts from; every value that is old says how old.</p>
    </div>
  );
}

/**
 * At the lower edge: the mission ahead and avoidance, always as tall, so that no instrument above is cut when something
 * appears.
 */
function Evasion() {
  if (!adopted.value || !hasSensors.live.value) return null;
  return (
    <footer class="evasion">
      <AheadLine />
      <Changes>
        <Avoidance />
      </Changes>
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
        {(isEmpty || !hasRoom("live")) && <TrackList source="live" rows={ROWS.narrow} />}
        <TrafficList source="live" />
        <MissionAhead source="live" />
        <Sensors source="live" />
        <Looking source="live" />
        <Health source="live" />
        {(!isEmpty || texts.value.length > 0) && <VehicleMessages />}
      </div>
      <Evasion />
    </>
  );
}
