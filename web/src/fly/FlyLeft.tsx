import { Changes } from "../ui/Changes";
import { adopted, isInAir, linkStatus } from "../store/flying";
import { closeReview, isReplaying, review } from "../store/review";
import { Manoeuvres, standLeft } from "../obstacles/Manoeuvres";
import { ObstaclesSection } from "./ObstaclesSection";
import { TrafficSection } from "../traffic/TrafficSection";
import { Button } from "../ui/Button";
import { Icon } from "../ui/Icon";
import { ConnectionSection } from "./Connection";
import { FlightSection } from "./FlightSection";
import { GuidedSection } from "./GuidedSection";
import { HomeSection } from "./HomeSection";
import { NextAction } from "./NextAction";
import { OnboardSection } from "./Onboard";
import { ParametersSection } from "./ParametersSection";
import { PreflightSection } from "./Preflight";
import { LogsSection } from "./VehicleLogs";

/** All pages share the 3D view: it shows the recording that any of them reviews. */
function ReviewOpen() {
  if (!isReplaying.value) return null;
  const isInView = Boolean(review.value?.terrain_name);
  return (
    <div class="callout wrap-row review-open" data-testid="review-open">
      <Icon name="info" />
      <p>
        {isInView
          ? "A recording is open for review: the 3D view shows it, not the vehicle."
          : "A recording is open for review. It lies over no surface model that is known here, so the 3D view does not show it."}
      </p>
      <Changes>
        <Button testid="close-review" onClick={() => void closeReview()}>
          Close the recording
        </Button>
      </Changes>
    </div>
  );
}

/** Such as a second vehicle with the same number: read before anything else. */
function LinkWarnings() {
  const warnings = linkStatus.value?.status.warnings ?? [];
  return (
    <>
      {warnings.map((warning) => (
        <p class="callout link-warning" key={warning} data-testid="link-warning">
          <Icon name="warning" /> <span>{warning}</span>
        </p>
      ))}
    </>
  );
}

/** Only the operator can tell whether it is the one that fell silent: nothing is sent to it until then. */
function HeardElsewhere() {
  const again = linkStatus.value?.status.again;
  if (!again) return null;
  return (
    <div class="callout link-warning" role="alert" data-testid="heard-elsewhere">
      <Icon name="warning" />
      <p>
        Your vehicle is silent. A vehicle with its number {again.system_id} is heard from{" "}
        <strong>{again.peer || again.address}</strong>. If your radio or your companion computer has just
        restarted, press “It is this vehicle” below. If not, use the pilot's transmitter.
      </p>
    </div>
  );
}

/** From the connection to the flight, with the ways past what is ahead and the next step at its lower edge. */
export function FlyLeft() {
  // A vehicle that is there needs the least room: its connection closes once it is used.
  const hasTrouble = linkStatus.value?.status.connections.some((connection) => connection.state === "failed");
  return (
    <>
      <div class="panel-scroll">
        <ReviewOpen />
        <HeardElsewhere />
        <LinkWarnings />
        <ConnectionSection key={adopted.value && !hasTrouble ? "used" : "open"} />
        {isInAir.value && <FlightSection />}
        {isInAir.value && <GuidedSection />}
        {isInAir.value && <HomeSection />}
        <OnboardSection />
        <PreflightSection />
        {!isInAir.value && <FlightSection />}
        {!isInAir.value && <GuidedSection />}
        {!isInAir.value && <HomeSection />}
        <ObstaclesSection />
        <TrafficSection />
        <ParametersSection />
        <LogsSection />
      </div>
      {standLeft.value && adopted.value && (
        <div class="ways">
          <Changes>
            <Manoeuvres />
          </Changes>
        </div>
      )}
      <NextAction />
    </>
  );
}
