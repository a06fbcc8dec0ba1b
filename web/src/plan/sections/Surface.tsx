import { metres } from "../../format";
import { LIMITS, type PlanDoc, type SurfaceDoc } from "../../messages";
import { Section } from "../../ui/Section";
import { AutoField, Check, SliderField } from "../../ui/fields";
import { editGroup } from "../../store/plan";
import { result } from "../../store/state";

const set = (label: string, fields: Partial<SurfaceDoc>, dragging = false) =>
  editGroup("surface", "surface", label, fields, dragging);

/** Of a survey, H follows from ground sampling and camera. */
function SurveyHeight({ gsd_cm, height_m }: { gsd_cm: number; height_m: number | undefined }) {
  return (
    <dl class="figures-list" data-testid="survey-height">
      <dt>H, upwards</dt>
      <dd>
        {metres(height_m)} <span class="muted">from {gsd_cm} cm ground sampling</span>
      </dd>
    </dl>
  );
}

export function SurfaceSection({ plan: { surface, source, survey } }: { plan: PlanDoc }) {
  const { radius_m } = surface;
  const isSurvey = source === "survey";
  const height_m = isSurvey ? result.value?.survey?.height_m : surface.height_m;
  return (
    <Section
      id="surface"
      title="Safe surface"
      icon="surface"
      summary={`R ${metres(radius_m)}, H ${metres(height_m)}`}
      startsOpen
    >
      <SliderField
        label="R, sideways"
        hint="How far the safe surface keeps away from walls, trees and masts."
        unit="m"
        {...LIMITS.SurfaceDoc.radius_m}
        sliderMax={50}
        step={0.1}
        value={radius_m}
        testid="radius"
        onChange={(value, dragging) => set("Radius R", { radius_m: value }, dragging)}
      />
      {isSurvey ? (
        <SurveyHeight gsd_cm={survey.gsd_cm} height_m={height_m} />
      ) : (
        <SliderField
          label="H, upwards"
          hint="How high it runs above the ground."
          unit="m"
          {...LIMITS.SurfaceDoc.height_m}
          sliderMax={30}
          step={0.1}
          value={surface.height_m}
          testid="height"
          onChange={(value, dragging) => set("Height H", { height_m: value }, dragging)}
        />
      )}
      <AutoField
        label="Own smoothing"
        auto={`(R / 10 = ${metres(radius_m / 10, 2)})`}
        unit="m"
        {...LIMITS.SurfaceDoc.smooth_sigma_m}
        step={0.1}
        value={surface.smooth_sigma_m}
        initial={Number((radius_m / 10).toFixed(2))}
        testid="smoothing"
        onChange={(smooth_sigma_m) => set("Smoothing", { smooth_sigma_m })}
      />
      <Check
        label="Never smooth below 0.8 H"
        checked={surface.floor}
        testid="floor"
        onChange={(floor) => set(floor ? "Keep the floor" : "Paper's pipeline", { floor })}
      />
      {!surface.floor && (
        <p class="hint">
          As in the paper: smoothing may cut the edges of the safe surface. The certificate still judges the
          result.
        </p>
      )}
    </Section>
  );
}
