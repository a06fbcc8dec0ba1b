import { describe, expect, it } from "vitest";
import { asErrorDoc, errorFromBody } from "../src/net/api";
import { retryDelay_ms, streamUrl } from "../src/net/socket";

describe("an error answer", () => {
  const doc = { code: "raster_no_crs", what: "No CRS.", where: "x.tif", advice: "Declare it." };

  it("speaks in the server's words", () => {
    expect(errorFromBody(422, JSON.stringify(doc)).doc).toEqual(doc);
    expect(errorFromBody(422, JSON.stringify({ error: doc })).doc).toEqual(doc);
  });

  it.each(["<html>bad gateway</html>", "", "null", '{"detail":[]}'])("%j still says its status", (body) => {
    const error = errorFromBody(502, body);
    expect(error.status).toBe(502);
    expect(error.doc.what).toContain("502");
  });

  it("is made of anything thrown", () => {
    expect(asErrorDoc(new Error("boom")).what).toBe("boom");
    expect(asErrorDoc(errorFromBody(422, JSON.stringify(doc)))).toEqual(doc);
  });
});

describe("the stream", () => {
  it("is beside the page, encrypted as the page is", () => {
    expect(streamUrl({ protocol: "http:", host: "127.0.0.1:8000" })).toBe("ws://127.0.0.1:8000/ws");
    expect(streamUrl({ protocol: "https:", host: "gcs.example" })).toBe("wss://gcs.example/ws");
  });

  it("is retried soon at first, then ever later, at most every 5 s", () => {
    const delays = [0, 1, 2, 10, 100].map((attempt) => retryDelay_ms(attempt, 1));
    expect(delays).toEqual([300, 600, 1200, 5000, 5000]);
    expect(retryDelay_ms(0, 0)).toBeGreaterThan(200);
  });
});
