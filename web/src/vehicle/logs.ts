import { effect, signal } from "@preact/signals";
import type { VehicleLogsDoc } from "../messages";
import { requestJson } from "../net/api";
import { active, stillOf } from "../store/fleet";
import { order } from "../store/outcomes";

/** The logs on the vehicle, as they were listed last, and the one that is being read. */

export const LOGS = "vehicle-logs";
export const vehicleLogs = signal<VehicleLogsDoc | null>(null);

const PATH = "/api/link/logs";

/** Another vehicle is shown: it has other logs. */
effect(() => {
  void active.value;
  vehicleLogs.value = null;
});

async function ordered(path: string): Promise<void> {
  const isStill = stillOf();
  const answer = await order({ place: LOGS, path: PATH + path });
  const doc = answer && ((await answer.json()) as VehicleLogsDoc);
  if (doc && isStill()) vehicleLogs.value = doc;
}

export const askForLogs = () => ordered("/list");
export const downloadLog = (number: number) => ordered(`/${number}/download`);
export const cancelLog = () => ordered("/cancel");

/** What is known keeps standing while the server does not answer: the page says elsewhere that it does not. */
export async function lookAtLogs(): Promise<void> {
  const isStill = stillOf();
  const doc = await requestJson<VehicleLogsDoc>("GET", PATH).catch(() => null);
  if (doc && isStill()) vehicleLogs.value = doc;
}
