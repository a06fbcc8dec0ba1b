import type { ChartDoc, SeriesDoc } from "../messages";
import { PlotFrame, type Area } from "./PlotFrame";

const COLOURS = [
  "var(--flown)",
  "var(--accent)",
  "var(--radar-line)",
  "var(--vision-line)",
  "var(--replayed)",
] as const;

/** A series without a name, or one that is named after the one before it ("ours", "ours, in use"), has its colour. */
function coloured(series: readonly SeriesDoc[]): { one: SeriesDoc; colour: string }[] {
  let [named, last] = [-1, ""];
  return series.map((one) => {
    const goesOn = one.name === "" || (last !== "" && one.name.startsWith(`${last},`));
    if (!goesOn) [named, last] = [named + 1, one.name];
    const colour = COLOURS[Math.max(0, named) % COLOURS.length] ?? COLOURS[0];
    return { one, colour: one.printed ? "var(--text)" : colour };
  });
}

/** More points than these are drawn small. */
const MANY = 40;

const cross = (x: number, y: number) => `M${x - 6} ${y - 6}l12 12m0-12l-12 12`;

function Drawn({ one, colour, area }: { one: SeriesDoc; colour: string; area: Area }) {
  const at = one.x.map((x, index) => [area.x(x), area.y(one.y[index] ?? 0)] as const);
  if (one.printed && one.drawn === "points") {
    const d = at.map(([x, y]) => cross(x, y)).join("");
    return <path class="printed" d={d} stroke={colour} data-testid="printed-mark" />;
  }
  if (one.drawn === "points") {
    return (
      <g fill={colour} data-testid="chart-points">
        {at.map(([x, y], index) => (
          <circle key={index} cx={x} cy={y} r={at.length > MANY ? 2 : 5} />
        ))}
      </g>
    );
  }
  const d = at.map(([x, y], index) => `${index ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
  const kind = one.printed ? "curve printed-line" : "curve";
  return <path class={kind} d={d} stroke={colour} data-testid="chart-line" />;
}

function Key({ of, colour }: { of: SeriesDoc; colour: string }) {
  if (of.drawn === "line") {
    return <path class={of.printed ? "curve printed-line" : "curve"} d="M0 6h18" stroke={colour} />;
  }
  return of.printed ? (
    <path class="printed" d={cross(9, 6)} stroke={colour} />
  ) : (
    <circle cx="9" cy="6" r="4" fill={colour} />
  );
}

function Keys({ series }: { series: readonly SeriesDoc[] }) {
  return (
    <p class="series-keys">
      {coloured(series)
        .filter(({ one }) => one.name !== "")
        .map(({ one, colour }) => (
          <span key={one.name}>
            <svg width="18" height="12" aria-hidden="true">
              <Key of={one} colour={colour} />
            </svg>
            {one.name}
          </span>
        ))}
    </p>
  );
}

/** A scenario's curve with the paper's figures in it. */
export function ScenarioChart({ chart }: { chart: ChartDoc }) {
  return (
    <figure class="scenario-chart" data-testid="scenario-chart">
      <figcaption>{chart.title}</figcaption>
      <PlotFrame
        testid="chart-frame"
        label={chart.title}
        xLabel={chart.x_label}
        yLabel={chart.y_label}
        xSpan={chart.x_span}
        ySpan={chart.y_span}
        isTrue={chart.is_true}
        over={(area) => (
          <svg
            class="chart-series"
            x={area.left}
            y={area.top}
            width={area.width}
            height={area.height}
            viewBox={`${area.left} ${area.top} ${area.width} ${area.height}`}
          >
            {coloured(chart.series).map(({ one, colour }, index) => (
              <Drawn key={index} one={one} colour={colour} area={area} />
            ))}
          </svg>
        )}
      />
      <Keys series={chart.series} />
    </figure>
  );
}
