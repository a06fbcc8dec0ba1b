import { adopted, heard, texts } from "../store/flying";
import { Instruments } from "./Instruments";
import { VehicleMessages } from "./VehicleMessages";

/** What is true about the vehicle. */
export function FlyRight() {
  const isEmpty = adopted.value === null && heard.live.value === null;
  return (
    <div class="panel-scroll truth" tabIndex={0}>
      {isEmpty ? (
        <div class="teaching">
          <p>Attitude, heights, speeds and the way home appear here as soon as a vehicle is connected.</p>
          <p>Every height says what it counts from; every value that is old says how old.</p>
        </div>
      ) : (
        <Instruments source="live" />
      )}
      {(!isEmpty || texts.value.length > 0) && <VehicleMessages />}
    </div>
  );
}
