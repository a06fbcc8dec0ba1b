import { showChecklist } from "../store/checklist";
import { openDialog } from "../store/view";

/** The text of this vehicle profile's list, in its dialog. */
export function openChecklist(profile: string): void {
  showChecklist(profile);
  openDialog.value = "checklist";
}
