import { latLon, number } from "../../format";
import { LIMITS, USUAL_CAMERA, type CameraDoc, type PlanDoc, type SurveyDoc } from "../../messages";
import { Button } from "../../ui/Button";
import { AutoField } from "../../ui/fields";
import { NumberField } from "../../ui/NumberField";
import { editGroup } from "../../store/plan";
import { CopyPlace } from "../../ui/CopyPlace";

const CAMERA_FIELDS = [
  { key: "image_width_px", label: "Image width", unit: "px", step: 1, whole: true },
  { key: "image_height_px", label: "Image height", unit: "px", step: 1, whole: true },
  { key: "focal_mm", label: "Focal length", unit: "mm", step: 0.1 },
  { key: "sensor_width_mm", label: "Sensor width", unit: "mm", step: 0.1 },
  { key: "sensor_height_mm", label: "Sensor height", unit: "mm", step: 0.1 },
] as const;

const OVERLAPS = [
  { key: "side_overlap", label: "Side overlap", testid: "side-overlap-input" },
  { key: "front_overlap", label: "Front overlap", testid: "front-overlap-input" },
] as const;

const set = (label: string, fields: Partial<SurveyDoc>) => editGroup("survey", "points", label, fields);

function Corners({ polygon }: { polygon: SurveyDoc["polygon"] }) {
  if (polygon.length === 0) {
    return <p class="teach">Press Corners and click around the area, or drop a file with a polygon.</p>;
  }
  const remove = (index: number) =>
    set(`Delete corner ${index + 1}`, { polygon: polygon.filter((_, at) => at !== index) });
  return (
    <ol class="corner-list" data-testid="corner-list">
      {polygon.map((place, index) => (
        <li key={`${index} ${latLon(place)}`} data-testid="corner-row">
          <span class="badge">{index + 1}</span>
          <span class="place">{latLon(place)}</span>
          <CopyPlace place={place} name={`corner ${index + 1}`} />
          <Button
            kind="quiet"
            class="small"
            icon="trash"
            title={`Delete corner ${index + 1}`}
            onClick={() => remove(index)}
          />
        </li>
      ))}
    </ol>
  );
}

function Camera({ camera }: { camera: CameraDoc | null }) {
  const change = (next: CameraDoc) => editGroup("profile", "points", "Camera", { camera: next });
  if (!camera) {
    return (
      <div class="callout">
        <p>The vehicle profile has no camera: a survey needs one.</p>
        <Button testid="camera-add" onClick={() => change(USUAL_CAMERA)}>
          Add camera
        </Button>
      </div>
    );
  }
  return (
    <details class="details">
      <summary>
        Camera{" "}
        <span class="muted">
          {number(camera.image_width_px)} × {number(camera.image_height_px)} px, {camera.focal_mm} mm
        </span>
      </summary>
      <div class="field-grid">
        {CAMERA_FIELDS.map(({ key, ...field }) => (
          <NumberField
            key={key}
            {...field}
            {...LIMITS.CameraDoc[key]}
            value={camera[key]}
            onChange={(value) => change({ ...camera, [key]: value })}
          />
        ))}
      </div>
    </details>
  );
}

export function SurveyFields({ plan }: { plan: PlanDoc }) {
  const { survey, profile } = plan;
  return (
    <>
      <Corners polygon={survey.polygon} />
      <div class="field-grid">
        <NumberField
          label="Ground sampling"
          unit="cm"
          {...LIMITS.SurveyDoc.gsd_cm}
          step={0.1}
          value={survey.gsd_cm}
          testid="gsd-input"
          onChange={(gsd_cm) => set("Ground sampling", { gsd_cm })}
        />
        {OVERLAPS.map(({ key, ...field }) => (
          <NumberField
            key={key}
            {...field}
            unit="%"
            min={LIMITS.SurveyDoc[key].min * 100}
            max={LIMITS.SurveyDoc[key].max * 100}
            step={1}
            value={survey[key] * 100}
            onChange={(percent) => set(field.label, { [key]: percent / 100 })}
          />
        ))}
      </div>
      <AutoField
        label="Own angle of the lines"
        auto="(fewest turns)"
        unit="°"
        {...LIMITS.SurveyDoc.angle_deg}
        step={1}
        value={survey.angle_deg}
        testid="angle"
        onChange={(angle_deg) => set("Angle of the lines", { angle_deg })}
      />
      <Camera camera={profile.camera} />
    </>
  );
}
