import { batch } from "@preact/signals";
import type { ServerMessage, Snapshot, ViewDoc } from "../messages";
import { takeFlying } from "./flying";
import { takeSensing } from "./obstacles";
import { queue, showPlan } from "./plan";
import { confirm, forgetUnconfirmed } from "./reconnect";
import { takeReviewing } from "./review";
import { takeMoving } from "./moving";
import * as state from "./state";
import { traversability } from "./traversability";

/** Takes one message of the stream into the page's state. */
export function receive(message: ServerMessage): void {
  confirm(message);
  switch (message.type) {
    case "snapshot":
      // At once: nobody sees the new library beside the old plan.
      batch(() => takeSnapshot(message));
      forgetUnconfirmed();
      return;
    case "plan":
      queue.pushed(message.plan);
      showPlan();
      return;
    case "library":
      state.library.value = message.library;
      return;
    case "view":
      showView(message.view, state.document_.value?.terrain_id ?? null);
      return;
    case "selection":
      state.selection.value = message.selection;
      return;
    case "job":
      state.jobs.value = new Map(state.jobs.value).set(message.job.id, message.job);
      return;
    case "cursor":
      state.cursor.value = message;
      return;
    case "notice":
      state.notify(message.level, message.error);
      return;
    case "vehicle":
    case "track":
    case "text":
    case "link":
    case "transfer":
    case "flight":
    case "fly":
    case "lease":
    case "nodes":
    case "recorder":
      takeFlying(message, performance.now());
      return;
    case "recordings":
    case "review":
    case "replay":
      takeReviewing(message, performance.now());
      return;
    case "perception":
    case "alert":
    case "obstacles":
      takeSensing(message, performance.now());
      return;
    case "tracks":
      takeMoving(message, performance.now());
      return;
    case "traversability":
      traversability.value = message.traversability;
      return;
    default:
      message satisfies never;
      state.notifyText("warning", "The server sent a message this page does not know.", "Reload the page.");
  }
}

function takeSnapshot(message: Snapshot): void {
  queue.snapshot(message.plan);
  state.productVersion.value = message.product_version;
  state.pageId.value = message.page_id;
  state.library.value = message.library;
  showView(message.view, message.plan.document.terrain_id);
  state.selection.value = message.selection;
  state.jobs.value = new Map(message.jobs.map((job) => [job.id, job]));
  showPlan();
}

/** The server tells the legend's ends when it has drawn a terrain. */
function showView(view: ViewDoc, terrainId: string | null): void {
  state.view.value = view;
  state.pictured.value = view.legend_min_m === null ? null : terrainId;
}
