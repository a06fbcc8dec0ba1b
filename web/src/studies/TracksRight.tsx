import { forConsole, withUnit } from "../format";
import type { RadarTracksDoc } from "../messages";
import { Fact } from "../ui/Section";

/** What the tracks were held against. */
export function TracksRight({ found }: { found: RadarTracksDoc }) {
  const { asked, capture_name, part } = found;
  return (
    <div class="panel-scroll truth" tabIndex={0}>
      <section class="facts" data-testid="tracks-against">
        <h2>Held against</h2>
        <dl class="figures-list">
          <Fact label="Motion capture" value={capture_name} />
          {asked.poles.map(({ x_m, z_m }, index) => (
            <Fact
              key={index}
              label={`Pole ${index + 1}, x and z`}
              value={`${withUnit(x_m, "m", 2)}, ${withUnit(z_m, "m", 2)}`}
            />
          ))}
          <Fact label="Radar begins after" value={withUnit(asked.offset_s, "s", 2)} />
          <Fact label="Nose" value={asked.forward} />
        </dl>
        {part.notes.map((note) => (
          <p key={note}>{forConsole(note)}</p>
        ))}
        <p class="hint">
          A pole is in view within 76° and from 1 to 12 m, and followed where an object is within 1 m of it.
          Dashed is what the paper prints of the sensor.
        </p>
      </section>
    </div>
  );
}
