import { batch } from "@preact/signals";
import type { ServerMessage, Snapshot } from "../messages";
import { alarms } from "./alarms";
import { takeActive, takeFleet } from "./fleet";
import { takeFlying } from "./flying";
import { takeSensing } from "./obstacles";
import { guided } from "./guided";
import { home } from "./home";
import { queue, showPlan } from "./plan";
import { confirm, forgetUnconfirmed } from "./reconnect";
import { takeReviewing } from "./review";
import { takeMoving } from "./moving";
import { takeTraffic } from "./traffic";
import { forgetClock, takeClock } from "./server_clock";
import { radarFiles, runs } from "./studies";
import { forgetAsked, takeAnswer, takeSelection, takeView } from "./shared";
import * as state from "./state";
import { takeStations } from "./stations";
import { fetches, takeLists } from "./there";
import { traversability } from "./traversability";

/** Takes one message of the stream into the page's state. */
export function receive(message: ServerMessage): void {
  confirm(message);
  switch (message.type) {
    case "snapshot":
      forgetClock();
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
      takeView(message.view);
      return;
    case "selection":
      takeSelection(message.selection);
      return;
    case "answered":
      takeAnswer(message.change);
      return;
    case "clock":
      takeClock(message, performance.now());
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
    case "active":
      takeActive(message);
      return;
    case "fleet":
      takeFleet(message);
      return;
    case "stations":
      takeStations(message, performance.now());
      return;
    case "station_recordings":
      takeLists(message.stations, performance.now());
      return;
    case "station_fetches":
      fetches.value = message.fetches;
      return;
    case "alarms":
      alarms.value = message.alarms;
      return;
    case "vehicle":
    case "track":
    case "text":
    case "link":
    case "transfer":
    case "flight":
    case "fly":
    case "lease":
    case "me":
    case "health":
    case "nodes":
    case "recorder":
      takeFlying(message, performance.now());
      return;
    case "guided":
      guided.value = message.guided;
      return;
    case "home":
      home.value = message.home;
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
    case "traffic":
      takeTraffic(message, performance.now());
      return;
    case "radar_files":
      radarFiles.value = message.files;
      return;
    case "scenario_runs":
      runs.value = message.runs;
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
  state.jobs.value = new Map(message.jobs.map((job) => [job.id, job]));
  showPlan();
  forgetAsked();
  takeView(message.view);
  takeSelection(message.selection);
}
