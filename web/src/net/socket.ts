import type { ClientMessage, ServerMessage } from "../messages";
import { PROTOCOL_VERSION } from "../messages";

/** silent: the stream is open, and nothing comes, though the page asks every second. */
export type LinkState = "connecting" | "open" | "silent" | "lost";

export interface SocketEvents {
  message: (message: ServerMessage) => void;
  link: (state: LinkState) => void;
  /** The session has ended. */
  signIn: () => void;
  /** Something arrived that this page cannot read. */
  unreadable: (why: string) => void;
}

const SIGN_IN_CLOSE_CODE = 4401;
const LOOK_EVERY_MS = 500;
const PING_EVERY_MS = 1000;
const SILENT_MS = 3000;
/** A page that has not looked for so long was itself stopped, and has not been listening. */
const ASLEEP_MS = 1500;
const FIRST_RETRY_MS = 300;
const LONGEST_RETRY_MS = 5000;

/** How long to wait before the n-th retry: doubling, with some spread so that pages do not come all at once. */
export function retryDelay_ms(attempt: number, random: number): number {
  const full = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 2 ** attempt);
  return full * (0.75 + 0.25 * random);
}

/** The `/ws` stream; it reconnects by itself, as the page that it was: its 3D view stays, and the snapshot brings the rest up to date. */
export class Stream {
  private socket: WebSocket | null = null;
  private attempt = 0;
  private heard_ms = 0;
  private looked_ms = 0;
  private pinged_ms = 0;
  private state: LinkState = "connecting";
  private page: string | null = null;
  private vehicle: number | null = null;
  /** The vehicle that was chosen and is not shown yet: a choice outlives the stream that it was made on. */
  private chosen: number | null = null;

  constructor(
    private readonly url: string,
    private readonly events: SocketEvents,
  ) {}

  /** The vehicle that this page shows, or is to show. */
  get wanted(): number | null {
    return this.chosen ?? this.vehicle;
  }

  connect(): void {
    const shown = this.wanted === null ? "" : `&vehicle=${this.wanted}`;
    const again = this.page === null ? "" : `?page=${encodeURIComponent(this.page)}${shown}`;
    const socket = new WebSocket(`${this.url}${again}`);
    this.socket = socket;
    socket.onopen = () => this.ping(performance.now());
    socket.onmessage = (event) => this.read(event.data);
    const beat = setInterval(() => this.look(performance.now()), LOOK_EVERY_MS);
    socket.onclose = (event) => {
      clearInterval(beat);
      this.closed(event.code);
    };
  }

  /**
   * Messages of a lost link are dropped: they are pointers and view settings, stale by the time it is back. Only which
   * vehicle was chosen is kept.
   */
  send(message: ClientMessage): boolean {
    if (message.type === "choose_vehicle") this.chosen = message.vehicle;
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /**
   * A server that hangs keeps its sockets open: only its silence tells. The stream is not closed for that, because what
   * was on its way still comes when the server, or the line to it, goes on.
   */
  private look(now_ms: number): void {
    if (now_ms - this.looked_ms > ASLEEP_MS) this.heard_ms = now_ms;
    this.looked_ms = now_ms;
    if (this.state === "open" && now_ms - this.heard_ms >= SILENT_MS) this.becomes("silent");
    if (now_ms - this.pinged_ms > PING_EVERY_MS - LOOK_EVERY_MS / 2) this.ping(now_ms);
  }

  private ping(now_ms: number): void {
    this.pinged_ms = now_ms;
    this.send({ type: "ping", page_ms: now_ms });
  }

  private becomes(state: LinkState): void {
    this.state = state;
    this.events.link(state);
  }

  private read(data: unknown): void {
    this.heard_ms = performance.now();
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
    if (message.type === "snapshot") {
      this.attempt = 0;
      this.page = message.page_id;
    }
    if (message.type === "active") this.shows(message.vehicle);
    if (message.type === "snapshot" || this.state === "silent") this.becomes("open");
    this.events.message(message);
  }

  /** Another one than was chosen: it was chosen while this stream was not open yet, or the one before it was lost. */
  private shows(vehicle: number): void {
    this.vehicle = vehicle;
    const { chosen } = this;
    this.chosen = null;
    if (chosen !== null && chosen !== vehicle) this.send({ type: "choose_vehicle", vehicle: chosen });
  }

  private closed(code: number): void {
    this.socket = null;
    if (code === SIGN_IN_CLOSE_CODE) {
      this.events.signIn();
      return;
    }
    this.becomes("lost");
    setTimeout(() => this.connect(), retryDelay_ms(this.attempt, Math.random()));
    this.attempt += 1;
  }
}

/** The stream's address beside this page's own. */
export function streamUrl(location: { protocol: string; host: string }): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;
}
