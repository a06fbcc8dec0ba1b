import { number, withUnit } from "../format";
import type { Track, TracksStatus } from "../messages";
import { distance, offNose, type Level } from "../obstacles/obstacle_words";
import type { MovingWatch } from "../store/moving";
import { speed_m_s, type Velocity } from "./velocity";

/** Moving objects in a few words. */

export const speed = (value_m_s: number | null) => withUnit(value_m_s, "m/s", 1);

/** The sensor sees what stands still as well. */
export const trackSpeed = ({ moving, velocity_enu_m_s }: Track) =>
  moving ? speed(speed_m_s(velocity_enu_m_s)) : "still";

export const isComing = (track: Track) => track.closest_in_s > 0;

/** Nobody waits for what is farther off. */
const SOON_S = 60;

/** "1.8 m in 4 s": how near it will come, and when. */
export function closestWords(track: Track): string {
  if (!isComing(track)) return "not nearer";
  const when = track.closest_in_s <= SOON_S ? `in ${withUnit(track.closest_in_s, "s")}` : "later";
  return `${distance(track.closest_m)} ${when}`;
}

export const trackName = (id: number) => `#${id}`;

/** For who cannot see it, and beside the row. */
export function trackWords(track: Track, off_nose_deg: number | null): string {
  const where = off_nose_deg === null ? "" : `, ${offNose(off_nose_deg)}`;
  const closest = isComing(track) ? `closest ${closestWords(track)}` : "not getting nearer";
  const age = `followed for ${withUnit(track.age_s, "s")}, ${number(track.updates)} times seen`;
  const pace = track.remembered ? "out of the radar's sight" : trackSpeed(track);
  return `${trackName(track.id)}: ${distance(track.range_m)}${where}, ${pace}, ${closest}; ${age}`;
}

/** From -180 to 180, clockwise from the nose. */
export function offNoseOf(bearing_deg: number, heading_deg: number): number {
  return ((((bearing_deg - heading_deg + 180) % 360) + 360) % 360) - 180;
}

export const TRACK_WATCH: Record<MovingWatch, { word: string; level: Level }> = {
  waiting: { word: "no frame yet", level: "neutral" },
  running: { word: "watching", level: "neutral" },
  frozen: { word: "own position unknown", level: "bad" },
  stale: { word: "frames have stopped", level: "bad" },
  silent: { word: "silent", level: "bad" },
};

const towards = (velocity: Velocity, heading_deg: number | null) => {
  if (heading_deg === null) return "";
  const bearing_deg = (Math.atan2(velocity[0], velocity[1]) * 180) / Math.PI;
  return `, ${offNose(offNoseOf(bearing_deg, heading_deg))}`;
};

/** All that the velocity display shows, for who cannot see it. */
export function displayWords(status: TracksStatus, watch: MovingWatch, heading_deg: number | null): string {
  if (watch !== "running") return `Velocities: not watched, ${TRACK_WATCH[watch].word}`;
  const own = status.velocity_enu_m_s;
  const parts = [
    own ? `now ${speed(speed_m_s(own))}${towards(own, heading_deg)}` : "own velocity unknown",
    ...status.tracks
      .filter((track) => track.dangerous)
      .map((track) => `${trackName(track.id)} comes as near as ${closestWords(track)}`),
    ...(status.proposal ? [`proposed: ${status.proposal.text}`] : []),
    ...(status.no_proposal ? [status.no_proposal] : []),
  ];
  return `Velocities: ${parts.join("; ")}`;
}

/** What the display says in large letters where there is nothing to draw, or no way out. */
export function headline(status: TracksStatus, watch: MovingWatch): string {
  if (watch !== "running") return "NOT WATCHED";
  if (status.no_proposal) return "NO SAFE VELOCITY";
  return status.cones.length === 0 ? "NO TRACK NEAR" : "";
}
