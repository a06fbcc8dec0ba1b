import { forConsole, number, withUnit } from "../format";
import type { RadarDetectionDoc, RadarParametersDoc } from "../messages";
import { looksAt, marked, opened, shownFrame, shownTracks } from "../store/studies";
import { Icon } from "../ui/Icon";
import { Fact } from "../ui/Section";
import { TracksRight } from "./TracksRight";

const SENSORS = { awr1843: "AWR1843", position2go: "Position2Go" } as const;

function DetectionTable({ detections }: { detections: readonly RadarDetectionDoc[] }) {
  const tellsElevation = detections.some((one) => one.elevation_deg !== 0);
  return (
    <div class="detection-list" tabIndex={0}>
      <table class="study-table" data-testid="detections">
        <thead>
          <tr>
            <th scope="col">Range m</th>
            <th scope="col">Speed m/s</th>
            <th scope="col">Azim. °</th>
            {tellsElevation && <th scope="col">Elev. °</th>}
            <th scope="col">SNR dB</th>
          </tr>
        </thead>
        <tbody>
          {detections.map((one, index) => (
            <tr
              key={index}
              class={marked.value === index ? "marked" : ""}
              data-testid="detection-row"
              onPointerEnter={() => (marked.value = index)}
              onPointerLeave={() => (marked.value = null)}
            >
              <td>{number(one.range_m, 2)}</td>
              <td>{number(one.radial_speed_m_s, 2)}</td>
              <td>{number(one.azimuth_deg, 1)}</td>
              {tellsElevation && <td>{number(one.elevation_deg, 0)}</td>}
              <td>{number(one.snr_db, 1)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Parameters({ of }: { of: RadarParametersDoc }) {
  return (
    <dl class="figures-list" data-testid="radar-parameters">
      <Fact label="Read as of" value={SENSORS[of.sensor]} />
      <Fact label="Chirps × antennas × samples" value={`${of.chirps} × ${of.antennas} × ${of.samples}`} />
      <Fact label="Start frequency" value={withUnit(of.start_frequency_hz / 1e9, "GHz", 2)} />
      <Fact label="Range cells" value={withUnit(of.range_resolution_m, "m", 3)} />
      <Fact label="Farthest" value={withUnit(of.max_range_m, "m", 1)} />
      <Fact label="Speed cells" value={withUnit(of.velocity_resolution_m_s, "m/s", 3)} />
      <Fact label="Fastest, either way" value={withUnit(of.max_velocity_m_s, "m/s", 2)} />
      <Fact label="A frame every" value={withUnit(of.frame_period_s * 1000, "ms", 0)} />
    </dl>
  );
}

function Notes({ notes }: { notes: readonly string[] }) {
  if (notes.length === 0) return null;
  return (
    <section class="facts">
      <h2>Please note</h2>
      <ul class="warnings" data-testid="radar-notes">
        {notes.map((note) => (
          <li key={note}>
            <Icon name="warning" />
            <span>{forConsole(note)}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** What is true about the frame that is shown: its detections, what was assumed, and of which radar it is. */
export function RadarRight() {
  const [open, frame] = [opened.value, shownFrame.value];
  if (looksAt.value === "tracks" && shownTracks.value) return <TracksRight found={shownTracks.value} />;
  if (!open) {
    return (
      <div class="panel-scroll truth" tabIndex={0}>
        <div class="teaching">
          <p>
            The detections of a frame appear here: range, radial speed, azimuth and how far above the noise.
          </p>
          <p>The chain is the one that flies: both FFTs, CASO- and CA-CFAR, direction of arrival.</p>
        </div>
      </div>
    );
  }
  return (
    <div class="panel-scroll truth" tabIndex={0}>
      <section class="facts">
        <h2>
          Detections{" "}
          <span class="number" data-testid="detection-count">
            {frame ? frame.detections.length : ""}
          </span>
        </h2>
        {frame && frame.detections.length > 0 && <DetectionTable detections={frame.detections} />}
        {frame?.detections.length === 0 && <p class="muted">None in this frame.</p>}
        <p class="hint">Speed + is away, azimuth + to the right of the boresight.</p>
      </section>
      <Notes notes={open.notes} />
      <section class="facts">
        <h2>Radar</h2>
        <Parameters of={open.parameters} />
      </section>
    </div>
  );
}
