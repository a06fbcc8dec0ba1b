import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Stream, type LinkState } from "../src/net/socket";

class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readyState = FakeSocket.OPEN;
  pings = 0;
  chosen: number[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: ((event: { code: number }) => void) | null = null;
  constructor(readonly url: string) {
    FakeSocket.all.push(this);
  }
  send(text: string): void {
    const message = JSON.parse(text) as { type: string; vehicle: number };
    if (message.type === "ping") this.pings += 1;
    if (message.type === "choose_vehicle") this.chosen.push(message.vehicle);
  }
  says(message: object): void {
    this.onmessage?.({ data: JSON.stringify({ v: 1, ...message }) });
  }
}

const states: LinkState[] = [];
let socket: FakeSocket;
let stream: Stream;

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "setTimeout", "clearTimeout", "performance"] });
  vi.stubGlobal("WebSocket", FakeSocket);
  FakeSocket.all = [];
  states.length = 0;
  stream = new Stream("ws://x/ws", {
    message: () => undefined,
    link: (state) => states.push(state),
    signIn: () => undefined,
    unreadable: () => undefined,
  });
  stream.connect();
  socket = FakeSocket.all[0] as FakeSocket;
  socket.onopen?.();
  socket.says({ type: "snapshot", page_id: "p/1" });
});

afterEach(() => {
  vi.useRealTimers();
  vi.restoreAllMocks();
  vi.unstubAllGlobals();
});

/** This page is stopped for so long: no timer of it runs. */
function sleep(ms: number): void {
  const woken_ms = performance.now() + ms;
  vi.spyOn(performance, "now").mockImplementation(() => woken_ms);
}

describe("a stream that breaks off", () => {
  it("comes back as the page that it was, whose 3D view has stayed", () => {
    socket.onclose?.({ code: 1006 });
    vi.advanceTimersByTime(1000);
    expect(FakeSocket.all.map((each) => each.url)).toEqual(["ws://x/ws", "ws://x/ws?page=p%2F1"]);
  });
});

describe("a vehicle that is chosen", () => {
  const choose = (vehicle: number) => stream.send({ type: "choose_vehicle", vehicle });

  it("is shown by the next stream when this one breaks off before it answers", () => {
    socket.says({ type: "active", vehicle: 1 });
    choose(2);
    expect(stream.wanted).toBe(2);
    socket.onclose?.({ code: 1006 });
    vi.advanceTimersByTime(1000);
    expect(FakeSocket.all[1]?.url).toBe("ws://x/ws?page=p%2F1&vehicle=2");
  });

  it("is asked for again when it was chosen while nothing was open", () => {
    socket.says({ type: "active", vehicle: 1 });
    socket.onclose?.({ code: 1006 });
    vi.advanceTimersByTime(1000);
    const next = FakeSocket.all[1] as FakeSocket;
    next.readyState = 0;
    choose(3);
    next.readyState = FakeSocket.OPEN;
    next.says({ type: "active", vehicle: 1 });
    next.says({ type: "active", vehicle: 3 });
    expect(next.chosen).toEqual([3]);
    expect(stream.wanted).toBe(3);
  });
});

describe("a server that falls silent", () => {
  it("is pinged at once and every second, and is there as long as it answers", () => {
    expect(socket.pings).toBe(1);
    for (let second = 0; second < 30; second += 1) {
      vi.advanceTimersByTime(1000);
      socket.says({ type: "clock" });
    }
    expect(socket.pings).toBe(31);
    expect(states).toEqual(["open"]);
  });

  it("is said so after three seconds, and is back with its next word, on the same socket", () => {
    vi.advanceTimersByTime(2900);
    expect(states).toEqual(["open"]);
    vi.advanceTimersByTime(700);
    expect(states).toEqual(["open", "silent"]);
    vi.advanceTimersByTime(600_000);
    expect(states).toEqual(["open", "silent"]);
    socket.says({ type: "vehicle" });
    expect(states).toEqual(["open", "silent", "open"]);
    expect(FakeSocket.all).toHaveLength(1);
  });

  it("is lost once its socket closes", () => {
    vi.advanceTimersByTime(4000);
    socket.onclose?.({ code: 1006 });
    expect(states).toEqual(["open", "silent", "lost"]);
    vi.advanceTimersByTime(1000);
    expect(FakeSocket.all).toHaveLength(2);
    vi.advanceTimersByTime(10_000);
    expect(states.at(-1)).toBe("lost");
    FakeSocket.all[1]?.says({ type: "snapshot" });
    expect(states.at(-1)).toBe("open");
  });

  it("is not blamed by a page that was asleep itself", () => {
    vi.advanceTimersByTime(2000);
    sleep(60_000);
    vi.advanceTimersByTime(1000);
    expect(states).toEqual(["open"]);
  });

  it("is not blamed where timers are throttled and messages come", () => {
    for (let minute = 1; minute < 5; minute += 1) {
      sleep(59_000);
      socket.says({ type: "vehicle" });
      vi.advanceTimersByTime(500);
    }
    expect(states).toEqual(["open"]);
  });
});
