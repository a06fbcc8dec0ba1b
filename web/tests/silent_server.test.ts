import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Stream, type LinkState } from "../src/net/socket";

class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = FakeSocket.OPEN;
  sent: string[] = [];
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  constructor() {
    FakeSocket.all.push(this);
  }
  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.readyState = 2;
  }
  says(message: object): void {
    this.onmessage?.({ data: JSON.stringify({ v: 1, ...message }) });
  }
}

const states: LinkState[] = [];
let socket: FakeSocket;

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "setTimeout", "clearTimeout", "performance"] });
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.all = [];
  states.length = 0;
  new Stream("ws://x/ws", {
    message: () => undefined,
    link: (state) => states.push(state),
    signIn: () => undefined,
    unreadable: () => undefined,
  }).connect();
  socket = FakeSocket.all[0] as FakeSocket;
  socket.says({ type: "snapshot" });
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

describe("a server that falls silent", () => {
  it("is pinged every second, and is there as long as it answers", () => {
    for (let second = 0; second < 30; second += 1) {
      vi.advanceTimersByTime(1000);
      socket.says({ type: "clock" });
    }
    expect(socket.sent.map((text) => (JSON.parse(text) as { type: string }).type)).toEqual(
      Array<string>(30).fill("ping"),
    );
    expect(states).toEqual(["open"]);
  });

  it("is lost after three seconds, and back with its next word on the same socket", () => {
    vi.advanceTimersByTime(2900);
    expect(states).toEqual(["open"]);
    vi.advanceTimersByTime(1000);
    expect(states).toEqual(["open", "lost"]);
    socket.says({ type: "vehicle" });
    expect(states).toEqual(["open", "lost", "open"]);
    expect(FakeSocket.all).toHaveLength(1);
  });

  it("is given up after ten, and tried anew without waiting for it to close", () => {
    vi.advanceTimersByTime(10_500);
    expect(states).toEqual(["open", "lost", "lost"]);
    vi.advanceTimersByTime(1000);
    expect(FakeSocket.all).toHaveLength(2);
    FakeSocket.all[1]?.says({ type: "snapshot" });
    expect(states.at(-1)).toBe("open");
  });

  it("is not blamed by a page that was asleep itself", () => {
    vi.setSystemTime(Date.now());
    vi.spyOn(performance, "now").mockReturnValue(performance.now() + 60_000);
    vi.advanceTimersByTime(1000);
    expect(states).toEqual(["open"]);
  });
});
