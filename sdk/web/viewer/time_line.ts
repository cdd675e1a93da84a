// A slider that shows where a replay is in its recording, or what is kept of a session that comes from files, and lets the user seek.
// Other sessions have none.

import type { Client, TimeLine as Kept } from '../tandem';
import { element } from './elements';
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

/** A mark on the time line. */
export interface Mark {
  /** Of the line's length, 0 to 1. */
  place: number;
  /** Seconds of the recording at its first event. */
  at: number;
  /** Its events, one a line. */
  title: string;
}

/** Marks that are closer than this part of the line are one. */
const closest = 1 / 150;
const mostLines = 12;

/** The marks of a recording's events. Events outside of it are at its ends. */
export function marksOf(recording: Recording): Mark[] {
  const marks: (Mark & { lines: number })[] = [];
  for (const event of [...recording.events].sort((a, b) => a.at - b.at)) {
    const at = Math.min(Math.max(event.at, 0), recording.length);
    const place = at / recording.length;
    const line = `${clock(at)} ${event.text}`;
    const last = marks.at(-1);
    if (!last || place - last.place >= closest) {
      marks.push({ place, at, title: line, lines: 1 });
    } else if (++last.lines <= mostLines) {
      last.title += `\n${line}`;
    }
  }
  return marks.map(({ place, at, title, lines }) => ({
    place,
    at,
    title: lines > mostLines ? `${title}\n… and ${lines - mostLines} more` : title,
  }));
}

export class TimeLine {
  private readonly line = element('timeLine');
  private readonly slider = element<HTMLInputElement>('time');
  private recording: Recording | null = null;
  private held = false;
  private soughtAt = -Infinity;

  /** `seek` is called once a choice is made. */
  constructor(private readonly seek: (seconds: number) => void) {
    this.slider.addEventListener('input', () => {
      this.held = true;
      this.say(this.slider.valueAsNumber);
    });
    this.slider.addEventListener('change', () => {
      this.held = false;
      this.choose(this.slider.valueAsNumber);
    });
  }

  /** Of a session that begins. */
  set(recording: Recording | null): void {
    this.recording = recording;
    this.soughtAt = -Infinity;
    this.line.hidden = recording === null;
    if (!recording) return;
    this.slider.max = String(recording.length);
    element('marks').replaceChildren(...marksOf(recording).map((mark) => this.markAt(mark)));
    this.line.title = `Recorded on ${new Date(recording.started).toLocaleString()}`;
  }

  show(frame: number, allowed: boolean): void {
    this.slider.disabled = !allowed;
    if (!this.recording || this.held || performance.now() - this.soughtAt < patienceMs) return;
    const seconds = secondsOf(this.recording, frame);
    this.slider.value = String(seconds);
    this.say(seconds);
  }

  private choose(seconds: number): void {
    this.soughtAt = performance.now();
    this.seek(seconds);
  }

  private markAt(mark: Mark): HTMLElement {
    const button = document.createElement('button');
    button.className = 'mark';
    button.style.left = `${mark.place * 100}%`;
    button.title = mark.title;
    button.setAttribute('aria-label', mark.title);
    button.addEventListener('click', () => {
      if (this.slider.disabled) return;
      this.slider.value = String(mark.at);
      this.say(mark.at);
      this.choose(mark.at);
    });
    return button;
  }

  private say(seconds: number): void {
    const text = `${clock(seconds)} / ${clock(this.recording?.length ?? 0)}`;
    element('timeValue').textContent = text;
    this.slider.setAttribute('aria-valuetext', text);
  }
}

/** Of a session that comes from files: a slider over all that is kept, and a button for the present. */
export class AudienceLine {
  private readonly slider = element<HTMLInputElement>('time');
  private readonly button = element<HTMLButtonElement>('goLive');
  private held = false;
  /** Where a jump goes that is on its way, and since when. */
  private sought: { to: number; at: number } | null = null;

  constructor(private readonly client: Pick<Client, 'seek' | 'goLive'>) {
    element('timeLine').hidden = false;
    this.slider.addEventListener('input', () => {
      this.held = true;
      this.say(this.slider.valueAsNumber);
    });
    this.slider.addEventListener('change', () => {
      this.held = false;
      this.sought = { to: this.slider.valueAsNumber, at: performance.now() };
      this.client.seek(this.sought.to);
    });
    this.button.addEventListener('click', () => this.client.goLive());
  }

  show(line: Kept | null): void {
    this.slider.disabled = line === null;
    this.button.hidden = line === null || line.ended;
    if (!line) return;
    this.button.setAttribute('aria-pressed', String(line.live));
    if (this.held) return;
    this.slider.min = String(line.fromS);
    this.slider.max = String(line.toS);
    if (this.sought && (Math.abs(line.atS - this.sought.to) < 5 || performance.now() - this.sought.at > patienceMs)) this.sought = null;
    const at = this.sought?.to ?? line.atS;
    this.slider.value = String(at);
    this.say(at);
  }

  private say(seconds: number): void {
    const from = Number(this.slider.min);
    const text = `${clock(Math.max(0, seconds - from))} / ${clock(Number(this.slider.max) - from)}`;
    element('timeValue').textContent = text;
    this.slider.setAttribute('aria-valuetext', text);
  }
}
