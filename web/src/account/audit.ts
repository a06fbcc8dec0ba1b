import { signal } from "@preact/signals";
import type { AuditDoc } from "../messages";
import { asErrorDoc, requestJson } from "../net/api";
import { order } from "../store/outcomes";
import { setError } from "../store/state";

export const AUDIT = "audit";
export const EXPORT = "/api/audit/export";

/** As it was when the dialog last asked. */
export const auditLog = signal<AuditDoc | null>(null);

export async function readAudit(): Promise<void> {
  try {
    auditLog.value = await requestJson<AuditDoc>("GET", "/api/audit");
  } catch (error) {
    setError(AUDIT, asErrorDoc(error));
  }
}

export async function verifyAudit(): Promise<void> {
  const answer = await order({ place: AUDIT, path: "/api/audit/verify" });
  if (answer) auditLog.value = (await answer.json()) as AuditDoc;
}
