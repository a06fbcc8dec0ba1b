/** At most one call per period; the last one always arrives. */
export function throttled<T>(period_ms: number, act: (value: T) => void): (value: T) => void {
  let last_ms = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  return (value) => {
    clearTimeout(timer);
    const run = () => {
      last_ms = performance.now();
      act(value);
    };
    const wait_ms = last_ms + period_ms - performance.now();
    if (wait_ms <= 0) run();
    else timer = setTimeout(run, wait_ms);
  };
}
