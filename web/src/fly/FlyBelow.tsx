import { ProfilePane } from "../chart/ProfilePane";
import { Manoeuvres, standLeft } from "../obstacles/Manoeuvres";
import { adopted } from "../store/flying";

/** The profile; above it, where the left panel is a drawer, the ways past what is ahead: no panel hides them. */
export function FlyBelow() {
  return (
    <>
      {!standLeft.value && adopted.value && (
        <div class="ways below">
          <Manoeuvres />
        </div>
      )}
      <ProfilePane />
    </>
  );
}
