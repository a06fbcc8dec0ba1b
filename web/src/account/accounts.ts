import { signal } from "@preact/signals";
import type { AccountDoc, InvitationDoc, SessionDoc } from "../messages";
import { asErrorDoc, requestJson } from "../net/api";
import { me } from "../store/flying";
import { order } from "../store/outcomes";
import { setError } from "../store/state";

export const PLACE = "accounts";

/** As they were when the dialog last asked; only operators may know. */
export const accounts = signal<readonly AccountDoc[]>([]);
export const sessions = signal<readonly SessionDoc[]>([]);
export const invitation = signal<(InvitationDoc & { name: string }) | null>(null);

export async function refresh(): Promise<void> {
  if (me.value?.role !== "operator") return;
  try {
    accounts.value = await requestJson<AccountDoc[]>("GET", "/api/accounts");
    sessions.value = await requestJson<SessionDoc[]>("GET", "/api/sessions");
  } catch (error) {
    setError(PLACE, asErrorDoc(error));
  }
}

async function change(
  method: "POST" | "PUT" | "DELETE",
  path: string,
  body: object = {},
  done = "Done.",
): Promise<Response | null> {
  const answer = await order({ place: PLACE, method, path, body, done });
  if (answer) await refresh();
  return answer;
}

async function invited(name: string, path: string, body: object = {}): Promise<boolean> {
  const answer = await change("POST", path, body);
  if (answer) invitation.value = { ...((await answer.json()) as InvitationDoc), name };
  return answer !== null;
}

const pathOf = (name: string) => `/api/accounts/${encodeURIComponent(name)}`;

export const addAccount = (name: string, role: AccountDoc["role"]) =>
  invited(name, "/api/accounts", { name, role });
export const invite = (name: string) => invited(name, `${pathOf(name)}/invitation`);
export const removeAccount = (name: string) => change("DELETE", pathOf(name));
export const endSession = (id: string) => change("DELETE", `/api/sessions/${id}`);
export const endOthers = () => change("DELETE", "/api/sessions", {}, "Signed out everywhere else.");
export const changePassword = (password: string) =>
  change("PUT", "/api/session/password", { password }, "Your password is changed.");
