import { isAlarming } from "../store/obstacles";
import { sound } from "../store/prefs";
import { Button } from "../ui/Button";
import { mayBeHeard, switchSound } from "./sound";

/** Whether alerts sound on this computer. */
export function SoundSwitch() {
  const on = sound.value;
  const waits = on && !mayBeHeard.value;
  const title = waits
    ? "Sound of alerts: on, once you have clicked or pressed a key on this page"
    : `Sound of alerts: ${on ? "on" : "off"} (M)`;
  return (
    <Button
      kind="quiet"
      class={`sound-switch ${isAlarming.value && !on ? "muted-alarm" : ""}`}
      icon={on ? "sound" : "silent"}
      title={title}
      pressed={on}
      testid="sound"
      onClick={() => void switchSound(!on)}
    />
  );
}
