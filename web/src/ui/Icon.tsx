/** Line icons on a 24-unit grid, drawn for this console. */
const PATHS = {
  terrain: "M2 19 9 8l4 5 3-4 6 10z",
  pin: "M12 21s7-6.2 7-11a7 7 0 1 0-14 0c0 4.8 7 11 7 11zm0-8.2a2.8 2.8 0 1 0 0-5.6 2.8 2.8 0 0 0 0 5.6z",
  drone:
    "M5 5l14 14M19 5 5 19M5 8a3 3 0 1 1 0-6 3 3 0 0 1 0 6zm14 0a3 3 0 1 1 0-6 3 3 0 0 1 0 6zM5 22a3 3 0 1 1 0-6 3 3 0 0 1 0 6zm14 0a3 3 0 1 1 0-6 3 3 0 0 1 0 6z",
  surface: "M2 18c4 0 5-6 10-6s6 3 10 3M2 11c4 0 5-6 10-6s6 3 10 3",
  speed: "M4 18a9 9 0 1 1 16 0M12 14l4-5",
  flag: "M6 21V4h11l-2 4 2 4H6",
  select: "M6 3l12 10-5.5 1L16 21l-3 1-3-7-4 3.5z",
  home: "M4 11l8-7 8 7M6 10v10h12V10M10 20v-6h4v6",
  polygon: "M5 8l7-5 8 6-3 10H8z",
  undo: "M9 14 4 9l5-5M4 9h10a6 6 0 0 1 0 12h-3",
  redo: "M15 14l5-5-5-5M20 9H10a6 6 0 0 0 0 12h3",
  trash: "M4 7h16M9 7V4h6v3M6 7l1 14h10l1-14M10 11v6M14 11v6",
  copy: "M8 8h12v12H8zM16 8V4H4v12h4",
  up: "M6 15l6-6 6 6",
  down: "M6 9l6 6 6-6",
  grip: "M9 6h.01M15 6h.01M9 12h.01M15 12h.01M9 18h.01M15 18h.01",
  check: "M5 12.5l4.5 4.5L19 7.5",
  cross: "M6 6l12 12M18 6 6 18",
  warning: "M12 3.5 22 20.5H2zM12 10v5M12 17.6v.2",
  info: "M12 21a9 9 0 1 1 0-18 9 9 0 0 1 0 18zM12 11v6M12 7.4v.2",
  sun: "M12 16.5a4.5 4.5 0 1 1 0-9 4.5 4.5 0 0 1 0 9zM12 2v2M12 20v2M2 12h2M20 12h2M5 5l1.4 1.4M17.6 17.6 19 19M19 5l-1.4 1.4M6.4 17.6 5 19",
  moon: "M20 14.5A8.5 8.5 0 0 1 9.5 4 8.5 8.5 0 1 0 20 14.5z",
  help: "M9 9a3 3 0 1 1 4.2 2.8c-.9.4-1.2 1-1.2 2.2M12 17.4v.2M12 21.5a9.5 9.5 0 1 1 0-19 9.5 9.5 0 0 1 0 19z",
  export: "M12 15V3M7.5 7.5 12 3l4.5 4.5M4 14v6h16v-6",
  import: "M12 3v12M7.5 10.5 12 15l4.5-4.5M4 14v6h16v-6",
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  top: "M12 3l3.5 9-3.5-2-3.5 2zM5 21h14M5 17h14",
  bell: "M6 17V11a6 6 0 1 1 12 0v6l1.5 2h-15zM10 21.5h4",
  folder: "M3 6h6l2 3h10v11H3z",
  menu: "M4 6h16M4 12h16M4 18h16",
  chart: "M4 4v16h16M7 15l4-5 3 3 5-7",
  print: "M7 8V3h10v5M7 17H4V8h16v9h-3M7 14h10v7H7z",
  plus: "M12 5v14M5 12h14",
  minus: "M5 12h14",
  shield: "M12 2.5 20 5.5v6c0 5-3.4 8.3-8 10-4.6-1.7-8-5-8-10v-6z",
  radar:
    "M12 12 18 6M12 21a9 9 0 1 1 6.4-15.4M12 16.5a4.5 4.5 0 1 1 3.2-7.7M12 12h.01M20.6 9.5a9 9 0 0 1-3.2 9.6",
  sound: "M4 9.5v5h3.5L12 19V5L7.5 9.5zM15.5 9a4 4 0 0 1 0 6M18 6.5a8 8 0 0 1 0 11",
  silent: "M4 9.5v5h3.5L12 19V5L7.5 9.5zM16 9.5l5 5M21 9.5l-5 5",
  route:
    "M6 20a2 2 0 1 1 0-4 2 2 0 0 1 0 4zM18 8a2 2 0 1 1 0-4 2 2 0 0 1 0 4zM8 18h7a3.5 3.5 0 0 0 0-7H9a3.5 3.5 0 0 1 0-7h7",
  pause: "M8 5v14M16 5v14",
  play: "M7 4.5v15l12-7.5z",
  return: "M9 13 4 8l5-5M4 8h9a6.5 6.5 0 0 1 0 13H9",
  land: "M12 3v11M7 9.5l5 5 5-5M4 20h16",
  power: "M12 3v9M6.5 7a8 8 0 1 0 11 0",
  upload: "M12 16V4M7.5 8.5 12 4l4.5 4.5M4 20h16",
  signal: "M4 20v-4M10 20v-8M16 20V8M21 20V4",
  satellite:
    "M4 20a9 9 0 0 0-1-6M9 20a14 14 0 0 0-6-11M4.5 19.5l6-6M9 9l6 6 2-2-6-6zM11 4l3 3M17 10l3 3M14 7l4-4 3 3-4 4",
  battery: "M2 8h17v9H2zM22 11v3",
  user: "M12 12a4 4 0 1 0 0-8 4 4 0 0 0 0 8zM4 21c0-4 3.5-6.5 8-6.5s8 2.5 8 6.5",
  eye: "M2 12s4-6.5 10-6.5S22 12 22 12s-4 6.5-10 6.5S2 12 2 12zM12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6z",
  record: "M12 19a7 7 0 1 0 0-14 7 7 0 0 0 0 14z",
  back: "M11 6 5 12l6 6M19 6l-6 6 6 6",
  forward: "M13 6l6 6-6 6M5 6l6 6-6 6",
  question: "M9 9a3 3 0 1 1 4.2 2.8c-.9.4-1.2 1-1.2 2.2M12 17.4v.2",
  sidestep: "M12 21v-6c0-4 7-3 7-8V3M15.5 6.5 19 3l3.5 3.5M4 4l5 5M9 4 4 9",
  plug: "M9 3v5M15 3v5M6 8h12v3a6 6 0 0 1-12 0zM12 17v4",
  clock: "M12 21a9 9 0 1 1 0-18 9 9 0 0 1 0 18zM12 7v5l3.5 2",
  target: "M12 19a7 7 0 1 1 0-14 7 7 0 0 1 0 14zM12 2v5M12 17v5M2 12h5M17 12h5",
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name, size = 18 }: { name: IconName; size?: number }) {
  return (
    <svg class="icon" viewBox="0 0 24 24" width={size} height={size} aria-hidden="true">
      <path d={PATHS[name]} />
    </svg>
  );
}
