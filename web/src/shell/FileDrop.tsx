import { useEffect } from "preact/hooks";
import { Icon } from "../ui/Icon";
import { takeRecordings } from "../review/ReviewLeft";
import { droppedFiles, partsOfProjects, terrainModels } from "../store/dropped";
import { isObserver, whyObserver } from "../store/flying";
import { notifyText } from "../store/state";
import { isRadarLog, recordingsAmong, takeFiles } from "../store/files";
import { dragging, goTo, study, viewId } from "../store/view";
import { bringIn, isRadarSamples } from "../studies/radar";
import { takeRadarLogs } from "../traversability/ground_orders";
import { carriesFiles } from "../ui/choose_files";

/** A .csv holds points, unless radar files are what is looked at. */
function isSamples(file: File): boolean {
  const looksAtThem = viewId.value === "review" && study.value === "radar";
  return isRadarSamples(file) || (looksAtThem && /\.csv$/i.test(file.name));
}

function Kinds() {
  return (
    <>
      <Icon name="import" size={40} />
      <p class="drop-title">Drop to open</p>
      <p>Surface model: GeoTIFF, ESRI ASCII grid, .zip of tiles or of a project</p>
      <p>Point cloud: LAS, LAZ, COPC, PLY, PCD, E57</p>
      <p>Textured mesh over its surface model: .glb, .zip of 3D Tiles</p>
      <p>Points or polygon: CSV, GeoJSON, KML, KMZ, .waypoints, .plan</p>
      <p>Recorded flight: .mcap, .tlog, .bin, .ulg; ROS bag: .bag, .db3, .mcap, .zip</p>
      <p>UWB radar log: .npz; raw radar samples: .npy, .bin</p>
    </>
  );
}

/** The veil takes the drop all the same: the browser would leave the console to open the file. */
function Refused({ why }: { why: string }) {
  return (
    <>
      <Icon name="eye" size={40} />
      <p class="drop-title">Nothing is opened</p>
      <p>{why}.</p>
    </>
  );
}

/** Files may be dropped anywhere. While one is dragged a veil covers the page, the 3D view included, and takes
 * the drop. */
export function FileDrop() {
  useEffect(() => {
    const enter = (event: DragEvent) => {
      if (!carriesFiles(event)) return;
      event.preventDefault();
      dragging.value = true;
    };
    window.addEventListener("dragenter", enter);
    window.addEventListener("dragover", enter);
    return () => {
      window.removeEventListener("dragenter", enter);
      window.removeEventListener("dragover", enter);
    };
  }, []);
  if (!dragging.value) return null;
  const end = () => (dragging.value = false);
  const drop = async (event: DragEvent) => {
    event.preventDefault();
    end();
    if (!event.dataTransfer || isObserver.value) return;
    const all = await droppedFiles(event.dataTransfer);
    const parts = new Set(partsOfProjects(all));
    if (parts.size > 0)
      notifyText(
        "error",
        "The folder is a mapping project or a mesh: nothing of it was opened.",
        "Drop it as a ZIP.",
      );
    const terrain = new Set(terrainModels(all.filter((file) => !parts.has(file))));
    if (terrain.size > 0) {
      const names = [...terrain].slice(0, 3).map((file) => file.name.slice(-60));
      const what = `Left out as terrain models (DTM): ${names.join(", ")}${terrain.size > 3 ? " ..." : ""}.`;
      notifyText("warning", what, "Trees and buildings are missing in them. Drop the surface model (DSM).");
    }
    const dropped = all.filter((file) => !parts.has(file) && !terrain.has(file));
    const recordings = await recordingsAmong(dropped);
    takeRecordings([...recordings]);
    const files = dropped.filter((file) => !recordings.has(file));
    takeRadarLogs(files.filter(isRadarLog));
    const samples = files.filter((file) => isSamples(file));
    if (samples.length > 0) goTo("review");
    void bringIn(samples);
    takeFiles(files.filter((file) => !isRadarLog(file) && !isSamples(file)));
  };
  return (
    <div
      class="drop-veil"
      data-testid="drop-veil"
      onDragOver={(event) => event.preventDefault()}
      onDragLeave={end}
      onDrop={(event) => void drop(event)}
      onClick={end}
    >
      <div class="drop-card">{whyObserver.value ? <Refused why={whyObserver.value} /> : <Kinds />}</div>
    </div>
  );
}
