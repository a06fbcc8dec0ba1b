import { useEffect, useId, useRef, useState } from "preact/hooks";
import { pending } from "../store/outcomes";
import { Icon, type IconName } from "./Icon";
import { Hold } from "./hold";

interface Props {
  label: string;
  icon: IconName;
  kind?: "plain" | "primary" | "return";
  disabled?: boolean;
  /** Why it is disabled, or what it will do. */
  title?: string;
  wide?: boolean;
  /** The place of its command: it shows when that is under way. */
  place: string;
  testid: string;
  onHold: () => void;
}

const HINT_MS = 2500;
const isHoldKey = (event: KeyboardEvent) => event.key === "Enter" || event.key === " ";

/** The ring that fills while the button is held. */
function Ring({ icon }: { icon: IconName }) {
  return (
    <span class="hold-ring" aria-hidden="true">
      <svg viewBox="0 0 36 36">
        <circle class="ring-track" cx="18" cy="18" r="15.9" />
        <circle class="ring-fill" cx="18" cy="18" r="15.9" pathLength="100" />
      </svg>
      <Icon name={icon} size={16} />
    </span>
  );
}

/** Acts after it has been held for a second, by pointer, finger or key; letting go or leaving it cancels. */
export function HoldButton(props: Props) {
  const { label, icon, kind = "plain", title, place, testid } = props;
  const id = useId();
  const button = useRef<HTMLButtonElement>(null);
  const hold = useRef(new Hold()).current;
  const act = useRef(props.onHold);
  act.current = props.onHold;
  const frame = useRef(0);
  const [words, setWords] = useState("");
  const isPending = pending.value.has(place);
  const disabled = props.disabled || isPending;

  const show = (share: number) => button.current?.style.setProperty("--held", String(share * 100));
  const stop = () => {
    cancelAnimationFrame(frame.current);
    show(0);
    if (hold.release() === "early") setWords("Hold it for one second");
  };
  const finish = () => {
    setWords("");
    show(0);
    act.current();
  };
  const step = (now_ms: number) => {
    show(hold.share(now_ms));
    if (hold.completes(now_ms)) finish();
    else if (hold.isHeld) frame.current = requestAnimationFrame(step);
  };
  // By the time of the events: a page that draws slowly hears late of a hold that was long enough.
  const start = (pressed_ms: number) => {
    if (disabled || hold.isHeld) return;
    setWords("Keep holding");
    hold.press(pressed_ms);
    frame.current = requestAnimationFrame(step);
  };
  const letGo = (released_ms: number) => {
    if (!disabled && hold.completes(released_ms)) finish();
    stop();
  };
  useEffect(() => {
    if (words === "" || words === "Keep holding") return undefined;
    const timer = setTimeout(() => setWords(""), HINT_MS);
    return () => clearTimeout(timer);
  }, [words]);
  useEffect(() => () => cancelAnimationFrame(frame.current), []);
  useEffect(() => {
    if (disabled) stop();
  }, [disabled]);

  const onPointerDown = (event: PointerEvent) => {
    if (event.button !== 0) return;
    const element = event.currentTarget as HTMLElement;
    // A finger is captured by what it touched: only without that does leaving the button show.
    if (element.hasPointerCapture(event.pointerId)) element.releasePointerCapture(event.pointerId);
    start(event.timeStamp);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (!isHoldKey(event)) return;
    event.preventDefault();
    if (!event.repeat) start(event.timeStamp);
  };
  const onKeyUp = (event: KeyboardEvent) => {
    if (!isHoldKey(event)) return;
    event.preventDefault();
    letGo(event.timeStamp);
  };
  const onClick = (event: MouseEvent) => {
    // Pointers count their clicks, and the keys' own are held back above.
    if (event.detail !== 0 || disabled) return;
    if (hold.virtualClick(performance.now())) act.current();
    else setWords(`${label}: press again to confirm`);
  };
  return (
    <span class={`hold ${props.wide ? "wide" : ""}`}>
      <button
        ref={button}
        type="button"
        class={`button hold-button ${kind}`}
        disabled={props.disabled}
        aria-disabled={isPending}
        title={title}
        aria-describedby={`${id}-how`}
        data-testid={testid}
        onPointerDown={onPointerDown}
        onPointerUp={(event) => letGo(event.timeStamp)}
        onPointerLeave={(event) => letGo(event.timeStamp)}
        onPointerCancel={stop}
        onContextMenu={(event) => event.preventDefault()}
        onKeyDown={onKeyDown}
        onKeyUp={onKeyUp}
        onBlur={stop}
        onClick={onClick}
      >
        <Ring icon={icon} />
        <span>{label}</span>
      </button>
      <span class="visually-hidden" id={`${id}-how`}>
        {isPending ? "Under way" : "Hold for one second, or press twice"}
      </span>
      <span class={`hold-hint ${words ? "shown" : ""}`} role="status">
        {words}
      </span>
    </span>
  );
}
