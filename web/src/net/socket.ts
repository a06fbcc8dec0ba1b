import type { ClientMessage, ServerMessage } from "../messages";
import { PROTOCOL_VERSION } from "../messages";

export type LinkState = "connecting" | "open" | "lost";

export interface SocketEvents {
  message: (message: ServerMessage) => void;
  link: (state: LinkState) => void;
  /** The session has ended. */
  signIn: () => void;
  /** Something arrived that this page cannot read. */
  unreadable: (why: string) => void;
}

const SIGN_IN_CLOSE_CODE = 4401;
const GIVEN_UP_CODE = 1006;
const PING_EVERY_MS = 1000;
/** Pings go unanswered for so long: the server, or the way to it, is lost; and then given up and tried anew. */
const SILENT_MS = 3000;
const GIVEN_UP_MS = 10_000;
const FIRST_RETRY_MS = 300;
const LONGEST_RETRY_MS = 5000;

/** How long to wait before the n-th retry: doubling, with some spread so that pages do not come all at once. */
export function retryDelay_ms(attempt: number, random: number): number {
  const full = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 2 ** attempt);
  return full * (0.75 + 0.25 * random);
}

/** The `/ws` stream; it reconnects by itself and the server's snapshot brings the page up to date. */
export class Stream {
  private socket: WebSocket | null = null;
  private attempt = 0;
  private heard_ms = 0;
  private looked_ms = 0;
  private isOpen = false;
  private isSilent = false;

  constructor(
    private readonly url: string,
    private readonly events: SocketEvents,
  ) {}

  connect(): void {
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.hear();
    const beat = setInterval(() => {
      if (this.look()) return;
      // Its close would wait for the server's.
      socket.onmessage = socket.onclose = null;
      socket.close();
      ended(GIVEN_UP_CODE);
    }, PING_EVERY_MS);
    const ended = (code: number) => {
      clearInterval(beat);
      this.closed(code);
    };
    socket.onmessage = (event) => this.read(event.data);
    socket.onclose = (event) => ended(event.code);
  }

  /** A server that hangs keeps its sockets open: only its silence tells. False: it is given up. */
  private look(): boolean {
    const now_ms = performance.now();
    // A page that was asleep itself has not been listening.
    if (now_ms - this.looked_ms > 2 * PING_EVERY_MS) this.heard_ms = now_ms;
    this.looked_ms = now_ms;
    const silent_ms = now_ms - this.heard_ms;
    if (silent_ms >= GIVEN_UP_MS) return false;
    if (silent_ms >= SILENT_MS && this.isOpen && !this.isSilent) {
      this.isSilent = true;
      this.events.link("lost");
    }
    this.send({ type: "ping", page_ms: now_ms });
    return true;
  }

  private hear(): void {
    this.heard_ms = this.looked_ms = performance.now();
    this.isSilent = false;
  }

  /** Messages of a lost link are dropped: they are pointers and view settings, stale by the time it is back. */
  send(message: ClientMessage): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private read(data: unknown): void {
    let message: ServerMessage;
    try {
      message = JSON.parse(String(data)) as ServerMessage;
    } catch {
      this.events.unreadable("a message that is not JSON");
      return;
    }
    if (message.v !== PROTOCOL_VERSION) {
      this.events.unreadable(`protocol version ${message.v}; this page speaks ${PROTOCOL_VERSION}`);
      return;
    }
    const isBack = this.isSilent;
    this.hear();
    if (message.type === "snapshot" || isBack) {
      this.attempt = 0;
      this.isOpen = true;
      this.events.link("open");
    }
    this.events.message(message);
  }

  private closed(code: number): void {
    this.socket = null;
    this.isOpen = false;
    if (code === SIGN_IN_CLOSE_CODE) {
      this.events.signIn();
      return;
    }
    this.events.link("lost");
    setTimeout(() => this.connect(), retryDelay_ms(this.attempt, Math.random()));
    this.attempt += 1;
  }
}

/** The stream's address beside this page's own. */
export function streamUrl(location: { protocol: string; host: string }): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;
}
