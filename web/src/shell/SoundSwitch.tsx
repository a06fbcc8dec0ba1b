import { adopted } from "../store/flying";
import { isLossCalling } from "../store/losses";
import { isAlarming } from "../store/obstacles";
import { sound } from "../store/prefs";
import { Button } from "../ui/Button";
import { Chip } from "../ui/Chip";
import { mayBeHeard, switchSound } from "./sound";

const waits = () => sound.value && !mayBeHeard.value;

/** Where it counts, in words; any press on the page is enough. */
export function SoundWaits() {
  if (!waits() || adopted.value === null) return null;
  return (
    <Chip
      icon="silent"
      level="near"
      text="Press for sound"
      title="Alarms are silent until you click or press a key on this page"
      testid="chip-sound"
      class="sound-waits"
    />
  );
}

/** Whether alarms sound on this computer. */
export function SoundSwitch() {
  const on = sound.value;
  const calls = isAlarming.value || isLossCalling.value;
  const title = waits()
    ? "Sound of alarms: on, once you have clicked or pressed a key on this page"
    : `Sound of alarms: ${on ? "on" : "off"} (M)`;
  return (
    <Button
      kind="quiet"
      class={`sound-switch ${calls && !on ? "muted-alarm" : ""}`}
      icon={on ? "sound" : "silent"}
      title={title}
      pressed={on}
      testid="sound"
      onClick={() => void switchSound(!on)}
    />
  );
}
