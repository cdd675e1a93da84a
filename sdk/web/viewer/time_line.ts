// A slider that shows where a replay is in its recording, and lets the user seek. Other sessions have none.

import { element } from './panel';
import type { Recording } from './scene_text';

/** A choice that nothing followed is forgotten after this. */
const patienceMs = 5000;

/** Seconds of the recording at which a frame was recorded, or a little before. */
export function secondsOf(recording: Recording, frame: number): number {
  const seconds = recording.from + Math.max(0, frame - recording.fromFrame) / recording.rate;
  return Math.min(seconds, recording.length);
}

/** Minutes and seconds; hours where there are some. */
export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  const two = (value: number) => String(value).padStart(2, '0');
  const minutes = Math.floor(whole / 60) % 60;
  const hours = Math.floor(whole / 3600);
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

export class TimeLine {
  private readonly line = element('timeLine');
  private readonly slider = element<HTMLInputElement>('time');
  private recording: Recording | null = null;
  private held = false;
  private soughtAt = -Infinity;

  /** `seek` is called once a choice is made. */
  constructor(seek: (seconds: number) => void) {
    this.slider.addEventListener('input', () => {
      this.held = true;
      this.say(this.slider.valueAsNumber);
    });
    this.slider.addEventListener('change', () => {
      this.held = false;
      this.soughtAt = performance.now();
      seek(this.slider.valueAsNumber);
    });
  }

  /** Of a session that begins. */
  set(recording: Recording | null): void {
    this.recording = recording;
    this.soughtAt = -Infinity;
    this.line.hidden = recording === null;
    if (!recording) return;
    this.slider.max = String(recording.length);
    this.line.title = `Recorded on ${new Date(recording.started).toLocaleString()}`;
  }

  show(frame: number, allowed: boolean): void {
    this.slider.disabled = !allowed;
    if (!this.recording || this.held || performance.now() - this.soughtAt < patienceMs) return;
    const seconds = secondsOf(this.recording, frame);
    this.slider.value = String(seconds);
    this.say(seconds);
  }

  private say(seconds: number): void {
    const text = `${clock(seconds)} / ${clock(this.recording?.length ?? 0)}`;
    element('timeValue').textContent = text;
    this.slider.setAttribute('aria-valuetext', text);
  }
}
