import { effect, signal } from "@preact/signals";
import { isBreachCalling } from "../store/breach";
import { calling, isCallingLoss } from "../store/fleet";
import { isLossCalling } from "../store/losses";
import { isAlarming } from "../store/obstacles";
import { sound } from "../store/prefs";

/** The alarms: each again and again while what it stands for is there and nobody has acknowledged it. */
interface Alarm {
  tones_hz: readonly number[];
  tone_s: number;
  period_ms: number;
}

/** Short and rising: something is ahead. */
const OBSTACLE: Alarm = { tones_hz: [880, 1175, 880], tone_s: 0.13, period_ms: 1600 };
/** Long and falling: server, link or vehicle is lost, the line is too slow to fly by, or a fence is crossed. */
const LOSS: Alarm = { tones_hz: [740, 494, 330], tone_s: 0.4, period_ms: 2400 };

const GAP_S = 0.04;
const LOUDNESS = 0.22;

let context: AudioContext | null = null;
/** Browsers let a page sound only after somebody has clicked it or pressed a key on it. */
export const mayBeHeard = signal(false);

function tone(audio: AudioContext, hz: number, at_s: number, tone_s: number): void {
  const [oscillator, gain] = [audio.createOscillator(), audio.createGain()];
  oscillator.type = "square";
  oscillator.frequency.value = hz;
  // Without its ramps each tone would click.
  gain.gain.setValueAtTime(0, at_s);
  gain.gain.linearRampToValueAtTime(LOUDNESS, at_s + 0.01);
  gain.gain.setValueAtTime(LOUDNESS, at_s + tone_s - 0.02);
  gain.gain.linearRampToValueAtTime(0, at_s + tone_s);
  oscillator.connect(gain).connect(audio.destination);
  oscillator.start(at_s);
  oscillator.stop(at_s + tone_s);
}

function call({ tones_hz, tone_s }: Alarm): void {
  if (context?.state !== "running") return;
  const [audio, start_s] = [context, context.currentTime + 0.02];
  tones_hz.forEach((hz, index) => tone(audio, hz, start_s + index * (tone_s + GAP_S), tone_s));
}

/** At once where the browser allows it, else at the first gesture; again where it has put the sound to sleep. */
async function wake(): Promise<void> {
  if (!sound.value) return;
  try {
    if (context === null) {
      const made = (context = new AudioContext());
      made.onstatechange = () => (mayBeHeard.value = made.state === "running");
    }
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
  call(OBSTACLE);
}

/** Of two the worse one: what a sensor said before the loss is old. */
function present(): Alarm | null {
  if (isLossCalling.value || isBreachCalling.value || isCallingLoss.value) return LOSS;
  return isAlarming.value || calling.value.length > 0 ? OBSTACLE : null;
}

export function startSound(): void {
  void wake();
  for (const gesture of ["pointerdown", "keydown"]) document.addEventListener(gesture, () => void wake());
  effect(() => {
    const alarm = present();
    if (!alarm || !sound.value || !mayBeHeard.value) return undefined;
    call(alarm);
    const timer = setInterval(() => call(alarm), alarm.period_ms);
    return () => clearInterval(timer);
  });
}
