import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { number, withUnit } from "../format";
import type { RadarDetectionDoc, RadarFrame, RadarMap } from "../messages";
import { marked } from "../store/studies";
import { GRADIENT, fan, powerAt, spanOfColumns, spanOfRows, upright, type Picture } from "./maps";
import { PlotFrame, type Area } from "./PlotFrame";

/** What lies under the pointer, in words. */
const pointed = signal<string | null>(null);

function Painted({ picture, area, isSharp }: { picture: () => Picture; area: Area; isSharp: boolean }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const context = canvas.current?.getContext("2d");
    if (!canvas.current || !context) return;
    const { width, height, rgba } = picture();
    canvas.current.width = width;
    canvas.current.height = height;
    context.putImageData(new ImageData(rgba, width, height), 0, 0);
  }, [picture]);
  const style = {
    left: `${area.left}px`,
    top: `${area.top}px`,
    width: `${area.width}px`,
    height: `${area.height}px`,
  };
  return <canvas ref={canvas} class={isSharp ? "sharp" : ""} style={style} aria-hidden="true" />;
}

interface Marks {
  detections: readonly RadarDetectionDoc[];
  place: (detection: RadarDetectionDoc) => [number, number];
}

function Detections({ detections, place }: Marks) {
  return (
    <g class="detections">
      {detections.map((detection, index) => {
        const [x, y] = place(detection);
        return (
          <circle
            key={index}
            class={marked.value === index ? "marked" : ""}
            cx={x}
            cy={y}
            r={marked.value === index ? 9 : 6}
            data-testid="detection-mark"
            onPointerEnter={() => (marked.value = index)}
            onPointerLeave={() => (marked.value = null)}
          />
        );
      })}
    </g>
  );
}

function DopplerMap({ frame }: { frame: RadarFrame }) {
  const map = frame.doppler;
  const picture = useRef<{ of: RadarMap; make: () => Picture }>({ of: map, make: () => upright(map) });
  if (picture.current.of !== map) picture.current = { of: map, make: () => upright(map) };
  return (
    <PlotFrame
      testid="doppler-map"
      label={`Power by range and radial speed, with ${frame.detections.length} detections`}
      xLabel="Range, m"
      yLabel="Radial speed, m/s (+ away)"
      xSpan={[0, spanOfColumns(map)[1]]}
      ySpan={spanOfRows(map)}
      under={(area) => <Painted picture={picture.current.make} area={area} isSharp />}
      over={(area) => (
        <Detections
          detections={frame.detections}
          place={(one) => [area.x(one.range_m), area.y(one.radial_speed_m_s)]}
        />
      )}
      onPoint={(range_m, speed_m_s) => {
        const power = range_m === null || speed_m_s === null ? null : powerAt(map, speed_m_s, range_m);
        pointed.value =
          power === null
            ? null
            : `${withUnit(range_m, "m", 1)}, ${withUnit(speed_m_s, "m/s", 1)}: ${withUnit(power, "dB", 0)}`;
      }}
    />
  );
}

/** Wide enough for what lies beside, and no finer than a screen. */
const FAN_PX = 480;

function FanMap({ frame, map }: { frame: RadarFrame; map: RadarMap }) {
  const reach_m = spanOfRows(map)[1];
  const make = () => fan(map, 2 * FAN_PX, FAN_PX, reach_m / FAN_PX);
  const picture = useRef<{ of: RadarMap; make: () => Picture }>({ of: map, make });
  if (picture.current.of !== map) picture.current = { of: map, make };
  return (
    <PlotFrame
      testid="azimuth-map"
      label={`Power by place as seen from above, with ${frame.detections.length} detections`}
      xLabel="Right of the boresight, m"
      yLabel="Forward, m"
      xSpan={[-reach_m, reach_m]}
      ySpan={[0, reach_m]}
      isTrue
      under={(area) => <Painted picture={picture.current.make} area={area} isSharp={false} />}
      over={(area) => (
        <Detections
          detections={frame.detections}
          place={(one) => [area.x(one.x_right_m), area.y(one.y_forward_m)]}
        />
      )}
      onPoint={(right_m, forward_m) => {
        if (right_m === null || forward_m === null) return void (pointed.value = null);
        const range_m = Math.hypot(right_m, forward_m);
        const power = powerAt(map, range_m, right_m / range_m);
        const azimuth_deg = (Math.atan2(right_m, forward_m) * 180) / Math.PI;
        pointed.value =
          power === null
            ? null
            : `${withUnit(range_m, "m", 1)}, ${withUnit(azimuth_deg, "°", 0)}: ${withUnit(power, "dB", 0)}`;
      }}
    />
  );
}

/** What a map's colours mean: each map has its own strongest cell. */
function ColourBar({ map, id }: { map: RadarMap; id: string }) {
  return (
    <span class="colour-bar" data-testid={`${id}-bar`}>
      <span class="number">{number(map.floor_db)}</span>
      <svg viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true">
        <defs>
          <linearGradient id={`${id}-colours`}>
            {GRADIENT.map(({ offset, colour }) => (
              <stop key={offset} offset={offset} stop-color={colour} />
            ))}
          </linearGradient>
        </defs>
        <rect width="100" height="10" fill={`url(#${id}-colours)`} />
      </svg>
      <span class="number">{number(map.top_db)} dB</span>
    </span>
  );
}

/** A frame's two maps, each with its detections. */
export function RadarMaps({ frame }: { frame: RadarFrame }) {
  return (
    <div class="radar-maps">
      <figure>
        <figcaption>
          Range and speed <ColourBar map={frame.doppler} id="doppler" />
          <span class="pointed" data-testid="pointed">
            {pointed.value ?? ""}
          </span>
        </figcaption>
        <DopplerMap frame={frame} />
      </figure>
      <figure>
        <figcaption>
          From above, all speeds {frame.azimuth && <ColourBar map={frame.azimuth} id="azimuth" />}
        </figcaption>
        {frame.azimuth ? (
          <FanMap frame={frame} map={frame.azimuth} />
        ) : (
          <p class="muted chart-empty">One antenna tells no azimuth.</p>
        )}
      </figure>
    </div>
  );
}
