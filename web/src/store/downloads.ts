import { signal } from "@preact/signals";
import { asErrorDoc, request } from "../net/api";
import { allSent } from "./plan";
import { setError } from "./state";

/** A file is being fetched. */
export const busy = signal(false);
const REPORT = "/api/plan/export/report.html?inline=1";

function fileName(response: Response, fallback: string): string {
  const header = response.headers.get("Content-Disposition") ?? "";
  return /filename="?([^";]+)"?/.exec(header)?.[1] ?? fallback;
}

export async function download(
  file: string,
  path = `/api/plan/export/${file}`,
  place = "export",
): Promise<void> {
  busy.value = true;
  setError(place, null);
  try {
    await allSent();
    const response = await request("GET", path);
    const address = URL.createObjectURL(await response.blob());
    const anchor = document.createElement("a");
    anchor.href = address;
    anchor.download = fileName(response, file);
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(address), 10_000);
  } catch (error) {
    setError(place, asErrorDoc(error));
  } finally {
    busy.value = false;
  }
}

/** The report in a new tab, and the browser's print dialog over it if asked for. */
export function openReport(print: boolean): void {
  const opened = window.open(REPORT, "_blank");
  if (!opened) {
    const what = "The browser did not open the report in a new tab.";
    setError("export", {
      code: "popup",
      what,
      where: "",
      advice: "Allow pop-ups for this page and try again.",
    });
  } else if (print) printWhenLoaded(opened);
}

/** A new tab starts as an empty page whose own `load` says nothing about the report: so its address is watched. */
function printWhenLoaded(opened: Window): void {
  const timer = setInterval(() => {
    if (opened.closed) clearInterval(timer);
    else if (opened.location.pathname.endsWith("report.html") && opened.document.readyState === "complete") {
      clearInterval(timer);
      opened.print();
    }
  }, 100);
}
