import { Segmented } from "../../ui/Button";
import { document_, view } from "../../store/state";
import { setView } from "../../store/stream";

const EXAGGERATIONS = [1, 1.5, 2, 3, 5];

/** How the terrain is drawn; shared by all pages, not part of the plan. */
export function LayerControls() {
  const { shading, vertical_exaggeration } = view.value;
  const hasPhoto = document_.value?.orthophoto_id != null;
  return (
    <>
      <Segmented
        label="Shading"
        testid="shading"
        value={shading}
        options={[
          { value: "height", label: "Heights" },
          { value: "hillshade", label: "Relief" },
          {
            value: "orthophoto",
            label: "Photo",
            disabled: !hasPhoto,
            title: hasPhoto ? "Orthophoto" : "Add an orthophoto first",
          },
        ]}
        onChange={(next) => setView({ shading: next })}
      />
      <div class="inline-choice">
        <span>Exaggerated</span>
        <Segmented
          label="Vertical exaggeration"
          testid="exaggeration"
          value={String(vertical_exaggeration)}
          options={EXAGGERATIONS.map((times) => ({ value: String(times), label: `${times}×` }))}
          onChange={(next) => setView({ vertical_exaggeration: Number(next) })}
        />
      </div>
    </>
  );
}
