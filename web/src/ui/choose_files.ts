import { takeFiles } from "../store/files";

/** Asks for files of this computer. */
export function chooseFiles(accept = "", take: (files: File[]) => void = takeFiles): void {
  const input = document.createElement("input");
  input.type = "file";
  input.accept = accept;
  input.onchange = () => take([...(input.files ?? [])]);
  input.click();
}

/** Whether what is dragged are files. */
export const carriesFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
