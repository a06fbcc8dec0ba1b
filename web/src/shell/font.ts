const PATIENCE_MS = 500;

/** Resolves when words can be drawn in the console's own font, so that nothing moves when it arrives; soon in any case. */
export async function fontReady(): Promise<void> {
  const loaded = document.fonts.load('16px "Roboto Variable"').catch(() => []);
  await Promise.race([loaded, new Promise((done) => setTimeout(done, PATIENCE_MS))]);
}
