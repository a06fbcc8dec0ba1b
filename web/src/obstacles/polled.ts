import { useEffect, useState } from "preact/hooks";
import { asErrorDoc, requestJson } from "../net/api";
import type { ErrorDoc } from "../messages";

export interface Polled<T> {
  value: T | null;
  error: ErrorDoc | null;
}

/** Asked again and again while it is shown and the page is seen; the next question waits for the last answer. */
export function usePolled<T>(path: string, every_ms: number): Polled<T> {
  const [polled, setPolled] = useState<Polled<T>>({ value: null, error: null });
  useEffect(() => {
    let timer = 0;
    let over = false;
    const ask = async () => {
      if (!document.hidden) {
        try {
          const value = await requestJson<T>("GET", path);
          if (!over) setPolled({ value, error: null });
        } catch (error) {
          if (!over) setPolled({ value: null, error: asErrorDoc(error) });
        }
      }
      if (!over) timer = window.setTimeout(() => void ask(), every_ms);
    };
    void ask();
    return () => {
      over = true;
      window.clearTimeout(timer);
    };
  }, [path, every_ms]);
  return polled;
}
