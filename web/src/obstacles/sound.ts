import { effect, signal } from "@preact/signals";
import { isAlarming } from "../store/obstacles";
import { sound } from "../store/prefs";

/** The alarm: three short tones, again and again, while an obstacle is there that nobody has acknowledged. */

const TONE_HZ = [880, 1175, 880] as const;
const TONE_S = 0.13;
const STEP_S = 0.17;
const PERIOD_MS = 1600;
const LOUDNESS = 0.22;

let context: AudioContext | null = null;
/** Browsers let a page sound only after somebody has clicked it or pressed a key on it. */
export const mayBeHeard = signal(false);

function tone(audio: AudioContext, hz: number, at_s: number): void {
  const [oscillator, gain] = [audio.createOscillator(), audio.createGain()];
  oscillator.type = "square";
  oscillator.frequency.value = hz;
  // Without its ramps each tone would click.
  gain.gain.setValueAtTime(0, at_s);
  gain.gain.linearRampToValueAtTime(LOUDNESS, at_s + 0.01);
  gain.gain.setValueAtTime(LOUDNESS, at_s + TONE_S - 0.02);
  gain.gain.linearRampToValueAtTime(0, at_s + TONE_S);
  oscillator.connect(gain).connect(audio.destination);
  oscillator.start(at_s);
  oscillator.stop(at_s + TONE_S);
}

function call(): void {
  if (context?.state !== "running") return;
  const start_s = context.currentTime + 0.02;
  TONE_HZ.forEach((hz, index) => context && tone(context, hz, start_s + index * STEP_S));
}

/** At the first gesture, and again where the browser has put the sound to sleep. */
async function wake(): Promise<void> {
  if (!sound.value) return;
  try {
    context ??= new AudioContext();
    if (context.state !== "running") await context.resume();
    mayBeHeard.value = context.state === "running";
  } catch {
    // A computer without sound: the alert is on the screen all the same.
    mayBeHeard.value = false;
  }
}

/** One call, so that whoever switches the sound on hears what it will be like. */
export async function switchSound(on: boolean): Promise<void> {
  sound.value = on;
  if (!on) return;
  await wake();
  call();
}

export function startSound(): void {
  for (const gesture of ["pointerdown", "keydown"]) document.addEventListener(gesture, () => void wake());
  effect(() => {
    if (!isAlarming.value || !sound.value || !mayBeHeard.value) return undefined;
    call();
    const timer = setInterval(call, PERIOD_MS);
    return () => clearInterval(timer);
  });
}
