// The last values of a figure, and a small plot of them.

export class History {
  private readonly values: number[] = [];

  constructor(private readonly length: number) {}

  add(value: number): void {
    this.values.push(Number.isFinite(value) ? value : 0);
    if (this.values.length > this.length) this.values.shift();
  }

  clear(): void {
    this.values.length = 0;
  }

  /** The newest at the right; the plot's width is a quarter of the history at first. */
  draw(canvas: HTMLCanvasElement, colour: string): void {
    const ratio = Math.min(window.devicePixelRatio, 2);
    const width = Math.round(canvas.clientWidth * ratio);
    const height = Math.round(canvas.clientHeight * ratio);
    const pen = canvas.getContext('2d');
    if (!pen || width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    pen.clearRect(0, 0, width, height);
    if (this.values.length < 2) return;
    const top = niceTop(Math.max(...this.values));
    const shown = Math.max(this.values.length, this.length / 4);
    const x = (i: number) => width * (1 - (this.values.length - 1 - i) / (shown - 1));
    const y = (value: number) => height - ratio - (value / top) * (height - 3 * ratio);
    const line = new Path2D();
    this.values.forEach((value, i) => line.lineTo(x(i), y(value)));
    const area = new Path2D(line);
    area.lineTo(width, height);
    area.lineTo(x(0), height);
    pen.globalAlpha = 0.16;
    pen.fillStyle = colour;
    pen.fill(area);
    pen.globalAlpha = 1;
    pen.strokeStyle = colour;
    pen.lineWidth = 1.25 * ratio;
    pen.lineJoin = 'round';
    pen.stroke(line);
  }
}

/** The next of 1, 2, 5, 10, ... times a power of ten, so that a plot's scale seldom changes. */
export function niceTop(value: number): number {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 2, 5, 10].find((step) => step * power >= value) ?? 10);
}
