import { useEffect, useRef } from "preact/hooks";

export interface Pen {
  context: CanvasRenderingContext2D;
  width: number;
  height: number;
  /** A colour of the present theme. */
  color: (name: string) => string;
}

interface Props {
  label: string;
  testid: string;
  count: number;
  draw: (pen: Pen) => void;
}

/** A canvas of a fixed height that is drawn again with every new picture. */
export function Drawn({ label, testid, count, draw }: Props) {
  const ref = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const canvas = ref.current;
    const context = canvas?.getContext("2d");
    if (!canvas || !context) return;
    const { clientWidth: width, clientHeight: height } = canvas;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const style = getComputedStyle(canvas);
    context.font = `600 12px ${style.fontFamily}`;
    draw({ context, width, height, color: (name) => style.getPropertyValue(name).trim() || "#fff" });
  });
  return (
    <canvas ref={ref} class="drawn" role="img" aria-label={label} data-testid={testid} data-count={count} />
  );
}

/** Round figures along the lower and the left edge, in metres. */
export function axes(pen: Pen, xs: [number, number][], ys: [number, number][]): void {
  const { context, width, height, color } = pen;
  context.strokeStyle = color("--chart-grid");
  context.fillStyle = color("--muted");
  context.lineWidth = 1;
  for (const [x, value] of xs) {
    line(context, [x, 0], [x, height]);
    context.textAlign = "center";
    if (x > 40 && x < width - 34) context.fillText(`${value}`, x, height - 4);
  }
  for (const [y, value] of ys) {
    line(context, [0, y], [width, y]);
    context.textAlign = "left";
    if (y > 20 && y < height - 20) context.fillText(`${value}`, 4, y - 3);
  }
  context.textAlign = "right";
  context.fillText("m", width - 4, height - 4);
}

export function line(context: CanvasRenderingContext2D, from: [number, number], to: [number, number]): void {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
}
