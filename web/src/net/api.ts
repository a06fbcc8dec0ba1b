import type { ErrorDoc } from "../messages";

/** A request that failed, with words for the operator. Status 0: no answer at all. */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    readonly doc: ErrorDoc,
  ) {
    super(doc.what);
  }
}

const NO_ANSWER: ErrorDoc = {
  code: "no_answer",
  what: "The Hedgehop server does not answer.",
  where: "",
  advice: "Check that it is still running; the page keeps trying.",
};

/** For answers that take work; nobody waits for ever for a server that hangs. */
const LIMIT_MS = 120_000;

function isErrorDoc(body: unknown): body is ErrorDoc {
  return typeof body === "object" && body !== null && "what" in body && typeof body.what === "string";
}

/** The error in a response's body, or words made from its status. */
export function errorFromBody(status: number, text: string): ApiError {
  try {
    const body: unknown = JSON.parse(text);
    const doc = typeof body === "object" && body !== null && "error" in body ? body.error : body;
    if (isErrorDoc(doc)) {
      return new ApiError(status, {
        code: doc.code ?? "http",
        what: doc.what,
        where: doc.where ?? "",
        advice: doc.advice ?? "",
      });
    }
  } catch {
    // Not JSON: a proxy's page, say. The status speaks below.
  }
  const what = `The server answered with status ${status}.`;
  return new ApiError(status, { code: "http", what, where: "", advice: "Try again, or reload the page." });
}

/** Makes an error of anything thrown. */
export function asErrorDoc(error: unknown): ErrorDoc {
  if (error instanceof ApiError) return error.doc;
  const what = error instanceof Error ? error.message : String(error);
  return { code: "page", what, where: "this page", advice: "Reload the page if it goes on." };
}

/** Leaves for the sign-in page, which says why unless the operator has just signed out here. */
export function goToSignIn(why: "ended" | "signed_out" = "ended"): void {
  location.assign(why === "ended" ? "/signin?ended=true" : "/signin");
}

const CANCELLED: ErrorDoc = { ...NO_ANSWER, code: "cancelled", what: "Cancelled." };

/** Whether somebody no longer wanted the answer: nothing to tell anyone. */
export const isCancelled = (error: unknown) => error instanceof ApiError && error.doc.code === "cancelled";

export interface Asking {
  /** Gives it up. */
  signal?: AbortSignal;
  limit_ms?: number;
  headers?: Readonly<Record<string, string>>;
}

/** Headers that every request carries. */
export const standing: Record<string, string> = {};

/** One request to our server; returns the answer if it is a good one. */
export async function request(
  method: string,
  path: string,
  body?: unknown,
  { signal, limit_ms = LIMIT_MS, headers = {} }: Asking = {},
): Promise<Response> {
  const limit = AbortSignal.timeout(limit_ms);
  const init: RequestInit = { method, credentials: "same-origin", headers: { ...standing, ...headers } };
  init.signal = signal ? AbortSignal.any([signal, limit]) : limit;
  if (method !== "GET") {
    init.headers = { "Content-Type": "application/json", ...standing, ...headers };
    init.body = JSON.stringify(body ?? {});
  }
  const response = await fetch(path, init).catch(() => {
    throw new ApiError(0, signal?.aborted ? CANCELLED : NO_ANSWER);
  });
  if (response.status === 401) goToSignIn();
  if (!response.ok) throw errorFromBody(response.status, await response.text());
  return response;
}

export async function requestJson<T>(
  method: string,
  path: string,
  body?: unknown,
  asking: Asking = {},
): Promise<T> {
  const response = await request(method, path, body, asking);
  return (await response.json()) as T;
}

export interface Upload {
  done: Promise<string>;
  cancel: () => void;
}

/** Sends a file's raw bytes; XMLHttpRequest, because fetch tells no progress of what it sends. */
export function upload(
  path: string,
  file: Blob,
  onProgress: (share: number) => void,
  method: "POST" | "PUT" = "POST",
): Upload {
  const xhr = new XMLHttpRequest();
  const done = new Promise<string>((resolve, reject) => {
    xhr.upload.onprogress = (event) => event.lengthComputable && onProgress(event.loaded / event.total);
    xhr.onerror = () => reject(new ApiError(0, NO_ANSWER));
    xhr.onabort = () => reject(new ApiError(0, CANCELLED));
    xhr.onload = () => {
      if (xhr.status === 401) goToSignIn();
      if (xhr.status >= 200 && xhr.status < 300) resolve(xhr.responseText);
      else reject(errorFromBody(xhr.status, xhr.responseText));
    };
  });
  xhr.open(method, path);
  xhr.setRequestHeader("Content-Type", "application/octet-stream");
  for (const [name, value] of Object.entries(standing)) xhr.setRequestHeader(name, value);
  xhr.send(file);
  return { done, cancel: () => xhr.abort() };
}
