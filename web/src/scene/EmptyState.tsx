import { Button } from "../ui/Button";
import { Changes } from "../ui/Changes";
import { chooseFiles } from "../ui/choose_files";
import { useDemo } from "../store/plans";
import { MODEL_FILES, sendTerrain } from "../store/files";

/** No terrain yet: what to do about it. */
export function EmptyState() {
  const choose = () => chooseFiles(MODEL_FILES, (files) => files.forEach((file) => void sendTerrain(file)));
  return (
    <div class="empty-state" data-testid="empty-state">
      <svg class="empty-picture" viewBox="0 0 320 110" aria-hidden="true">
        <path
          class="ground"
          d="M0 110V86l34-12 30 8 24-40 14 10 22-28 26 46 30 6 14-22h10l8 22 34 4 26-20 48 26v24z"
        />
        <path
          class="flight"
          d="M0 58c30-10 44-4 60-20s30-30 60-32 36 34 66 38 22-14 40-14 30 20 50 14 30-4 44 6"
        />
      </svg>
      <h2>Start with the ground</h2>
      <p>
        Drop a GeoTIFF surface model or a point cloud here, or anywhere on this page. Hedgehop lays a safe
        surface over it and plans paths that hug it.
      </p>
      <div class="row">
        <Changes>
          <Button kind="primary" icon="import" testid="empty-open" onClick={choose}>
            Open a model…
          </Button>
          <Button icon="terrain" testid="empty-demo" onClick={() => void useDemo()}>
            Use the demo terrain
          </Button>
        </Changes>
      </div>
    </div>
  );
}
