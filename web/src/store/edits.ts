import type { PlanDoc, PlanEdit, PlanState } from "../messages";

/** A change of the plan as a function, so that it can be made again on a newer document. */
export type Change = (document: PlanDoc) => PlanDoc;

export interface Edit {
  /** For the undo button. */
  label: string;
  /** Names the part of the page where an error of this edit is shown. */
  place: string;
  change: Change;
  /** Consecutive edits of the same label become one undo step. */
  coalesce: boolean;
}

/** What to do now: send a body, ask again after some milliseconds, or nothing. */
export type Step = { send: PlanEdit; place: string } | { wait_ms: number } | null;

/** Sliders send at most this often. */
const COALESCE_MS = 80;
/** So often an edit is made anew on a document that others have changed meanwhile. */
const MAX_REBASES = 3;

/**
 * Optimistic editing without input or output: shows local edits at once, sends one document at a time,
 * and keeps only the latest while one is in flight. The caller passes the clock and the answers.
 */
export class EditQueue {
  private base: PlanState | null = null;
  private flying: Edit[] = [];
  private waiting: Edit[] = [];
  private rebases = 0;
  private lastSent_ms = -Infinity;

  /** The server's latest state. */
  get server(): PlanState | null {
    return this.base;
  }

  /** The document with all local edits made on it. */
  get document(): PlanDoc | null {
    return this.base && this.replay([...this.flying, ...this.waiting], this.base.document);
  }

  get dirty(): boolean {
    return this.flying.length + this.waiting.length > 0;
  }

  edit(edit: Edit): void {
    if (this.base) this.waiting.push(edit);
  }

  next(now_ms: number): Step {
    const last = this.waiting.at(-1);
    if (!this.base || this.flying.length > 0 || !last) return null;
    const merges = this.waiting.every((edit) => edit.coalesce && edit.label === last.label);
    const wait_ms = merges ? this.lastSent_ms + COALESCE_MS - now_ms : 0;
    if (wait_ms > 0) return { wait_ms };
    this.flying = this.waiting;
    this.waiting = [];
    this.lastSent_ms = now_ms;
    const document = this.replay(this.flying, this.base.document);
    const send = { base_revision: this.base.revision, label: last.label, document, coalesce: merges };
    return { send, place: last.place };
  }

  /** The server took the edit in flight. */
  accepted(state: PlanState): void {
    this.flying = [];
    this.rebases = 0;
    this.takeAnswer(state);
  }

  /** The server refuses the edit in flight: the page shows the document without it. */
  refused(): void {
    this.flying = [];
    this.rebases = 0;
  }

  /** The answer never came: the same edits are sent again later. */
  unanswered(): void {
    this.waiting = [...this.flying, ...this.waiting];
    this.flying = [];
  }

  /** Somebody else was faster; returns whether the edits are made again on the newer document. */
  stale(state: PlanState): boolean {
    this.rebases += 1;
    const again = this.rebases <= MAX_REBASES && state.plan_id === this.base?.plan_id;
    if (again) this.unanswered();
    else this.drop();
    this.base = state;
    return again;
  }

  /** A state pushed by the server; another plan ends all local edits. */
  pushed(state: PlanState): void {
    if (state.plan_id !== this.base?.plan_id) this.drop();
    else if (state.revision < this.base.revision) return;
    this.base = state;
  }

  /** The first state of a connection is right whatever was known before; unsent edits survive. */
  snapshot(state: PlanState): void {
    if (state.plan_id !== this.base?.plan_id) this.drop();
    this.base = state;
  }

  /** The answer to a request; it may be older than what has been pushed meanwhile. */
  takeAnswer(state: PlanState): void {
    if (this.base && state.plan_id === this.base.plan_id) {
      if (state.revision < this.base.revision) return;
      const settled = this.base.computation.state !== "running";
      if (state.revision === this.base.revision && settled) return;
    }
    this.base = state;
  }

  private drop(): void {
    this.flying = [];
    this.waiting = [];
    this.rebases = 0;
  }

  private replay(edits: Edit[], document: PlanDoc): PlanDoc {
    return edits.reduce((current, edit) => edit.change(current), document);
  }
}
