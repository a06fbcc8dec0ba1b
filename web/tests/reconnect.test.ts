import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { fly, linkStatus } from "../src/store/flying";
import { confirm, forgetUnconfirmed } from "../src/store/reconnect";
import { flyState, linkStatus as link } from "./flight_samples";

describe("after a lost connection", () => {
  beforeEach(() => {
    vi.useFakeTimers();
  });

  afterEach(() => {
    vi.useRealTimers();
  });

  it("what the server tells again stays, and what it does not is forgotten after a while", () => {
    linkStatus.value = { status: link(), received_ms: 0 };
    fly.value = flyState();
    forgetUnconfirmed();
    confirm({ v: 1, type: "fly", fly: flyState() });
    vi.advanceTimersByTime(1000);
    expect(linkStatus.value).not.toBeNull();
    vi.advanceTimersByTime(5000);
    expect(linkStatus.value).toBeNull();
    expect(fly.value).not.toBeNull();
  });

  it("what was told before it does not count", () => {
    linkStatus.value = { status: link(), received_ms: 0 };
    confirm({ v: 1, type: "link", link: link() });
    forgetUnconfirmed();
    vi.advanceTimersByTime(5000);
    expect(linkStatus.value).toBeNull();
  });
});
