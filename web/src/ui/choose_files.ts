import { takeFiles } from "../store/files";

/** Asks for a file of this computer, or for several at once. */
export function chooseFiles(
  accept = "",
  take: (files: File[]) => void = takeFiles,
  { several = false } = {},
): void {
  const input = document.createElement("input");
  input.type = "file";
  input.accept = accept;
  input.multiple = several;
  input.onchange = () => take([...(input.files ?? [])]);
  input.click();
}

/** Whether what is dragged are files. */
export const carriesFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
