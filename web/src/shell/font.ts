const PATIENCE_MS = 500;
const FONT = '16px "Roboto Variable"';
/** One of each file of the font that the console's own words need beside the Latin one. */
const SIGNS = "≥◆";

/**
 * Resolves when words can be drawn in the console's own font, so that nothing moves when it arrives; soon in any case.
 * Its signs are fetched with it: what the page says when the server has gone may have them for the first time.
 */
export async function fontReady(): Promise<void> {
  const loaded = Promise.all([document.fonts.load(FONT), document.fonts.load(FONT, SIGNS)]).catch(() => []);
  await Promise.race([loaded, new Promise((done) => setTimeout(done, PATIENCE_MS))]);
}
