// The dial that shows gravity as the camera sees it and turns it when dragged: its disc is a hemisphere that faces
// the viewer, down into the screen in its middle, along the screen at its rim.

import type { Vec3 } from './scene';
import { add, dot } from './room';

/** Unit vectors that point right, up and towards the viewer. */
export type ViewAxes = [Vec3, Vec3, Vec3];

/** A direction on the disc: x right, y up, of length at most 1. `away`: into the screen rather than out of it. */
export interface DialPlace {
  x: number;
  y: number;
  away: boolean;
}

export function toDial(gravity: Vec3, [right, up, back]: ViewAxes): DialPlace {
  const strength = Math.hypot(...gravity) || 1;
  return { x: dot(gravity, right) / strength, y: dot(gravity, up) / strength, away: dot(gravity, back) <= 0 };
}

/** Places outside of the disc count as its rim. */
export function fromDial({ x, y, away }: DialPlace, strength: number, [right, up, back]: ViewAxes): Vec3 {
  const length = Math.hypot(x, y);
  const scale = length > 1 ? 1 / length : 1;
  const depth = Math.sqrt(Math.max(0, 1 - Math.min(length, 1) ** 2)) * (away ? -1 : 1);
  const direction = add(add(add([0, 0, 0], right, x * scale), up, y * scale), back, depth);
  return direction.map((c) => c * strength) as Vec3;
}

/**
 * Down in the device's axes (x right, y up, z out of the screen) from the angles of a DeviceOrientationEvent, in
 * degrees, and the angle by which the page is turned on the screen.
 */
export function downOfDevice(beta: number, gamma: number, screenAngle: number): Vec3 {
  const radians = Math.PI / 180;
  const [b, g, s] = [beta * radians, gamma * radians, screenAngle * radians];
  const x = Math.cos(b) * Math.sin(g);
  const y = -Math.sin(b);
  return [x * Math.cos(s) - y * Math.sin(s), y * Math.cos(s) + x * Math.sin(s), -Math.cos(b) * Math.cos(g)];
}


/** Binds the dial's canvas. */
export class GravityDial {
  private gravity: Vec3 = [0, -9.81, 0];
  private dragging = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly axes: () => ViewAxes,
    private readonly changed: (gravity: Vec3) => void,
  ) {
    const follow = (event: PointerEvent) => {
      if (!this.dragging) return;
      const area = canvas.getBoundingClientRect();
      const radius = (area.width / 2) * discShare;
      const x = (event.clientX - area.left - area.width / 2) / radius;
      const y = (area.top + area.height / 2 - event.clientY) / radius;
      this.turn({ x, y, away: true });
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.dragging = true;
      follow(event);
    });
    canvas.addEventListener('pointermove', follow);
    for (const end of ['pointerup', 'pointercancel'] as const) {
      canvas.addEventListener(end, () => (this.dragging = false));
    }
    canvas.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!step) return;
      event.preventDefault();
      const place = toDial(this.gravity, this.axes());
      this.turn({ x: place.x + step[0] / 8, y: place.y + step[1] / 8, away: place.away });
    });
  }

  /** Shows a gravity that came from elsewhere; not while the user drags. */
  show(gravity: Vec3): void {
    if (!this.dragging) this.gravity = gravity;
  }

  /** Keeps the direction. */
  setStrength(strength: number): void {
    const before = Math.hypot(...this.gravity);
    this.want(before > 0 ? (this.gravity.map((x) => (x * strength) / before) as Vec3) : [0, -strength, 0]);
  }

  want(gravity: Vec3): void {
    this.gravity = gravity;
    this.changed(gravity);
  }

  value(): Vec3 {
    return this.gravity;
  }

  private turn(place: DialPlace): void {
    this.want(fromDial(place, Math.hypot(...this.gravity), this.axes()));
  }

  draw(): void {
    const ratio = Math.min(window.devicePixelRatio, 2);
    const size = Math.round(this.canvas.clientWidth * ratio);
    if (size === 0) return;
    if (this.canvas.width !== size) this.canvas.width = this.canvas.height = size;
    const pen = this.canvas.getContext('2d');
    if (!pen) return;
    const place = toDial(this.gravity, this.axes());
    const key = `${size} ${place.x.toFixed(3)} ${place.y.toFixed(3)} ${place.away} ${this.dragging}`;
    if (key === this.drawn) return;
    this.drawn = key;
    drawDial(pen, size, place, this.dragging);
  }
  private drawn = '';
}

const discShare = 0.86;

function drawDial(pen: CanvasRenderingContext2D, size: number, place: DialPlace, active: boolean): void {
  const middle = size / 2;
  const radius = middle * discShare;
  pen.clearRect(0, 0, size, size);
  pen.lineWidth = size / 110;
  const disc = pen.createRadialGradient(middle, middle, radius * 0.1, middle, middle, radius);
  disc.addColorStop(0, 'rgb(30 41 53 / 0.85)');
  disc.addColorStop(1, 'rgb(17 24 32 / 0.85)');
  pen.fillStyle = disc;
  pen.strokeStyle = active ? '#7cc7ff' : '#3a4a59';
  pen.beginPath();
  pen.arc(middle, middle, radius, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
  pen.strokeStyle = '#26333f';
  for (const share of [1 / 3, 2 / 3]) {
    pen.beginPath();
    pen.arc(middle, middle, radius * share, 0, 2 * Math.PI);
    pen.stroke();
  }
  const [x, y] = [middle + place.x * radius, middle - place.y * radius];
  pen.strokeStyle = pen.fillStyle = '#7cc7ff';
  pen.lineWidth = size / 45;
  pen.lineCap = 'round';
  pen.beginPath();
  pen.moveTo(middle, middle);
  pen.lineTo(x, y);
  pen.stroke();
  pen.beginPath();
  pen.arc(x, y, size / 18, 0, 2 * Math.PI);
  if (!place.away) {
    pen.fillStyle = '#111820';
    pen.fill();
    pen.stroke();
  } else {
    pen.fill();
  }
}
