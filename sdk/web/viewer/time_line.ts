// A slider that shows where a replay is in its recording, or what is kept of a session that comes from files, and lets the user seek.
// Other sessions have none.

import type { Client, TimeLine as Kept } from '../tandem';
import { element, say } from './elements';
import type { Recording } from './scene';

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

/** The slider that both kinds of time line have. */
class TimeSlider {
  readonly input = element<HTMLInputElement>('time');
  /** The user is choosing. */
  held = false;

  /** `chosen` is called once a choice is made. */
  constructor(chosen: (seconds: number) => void) {
    this.input.addEventListener('input', () => {
      this.held = true;
      this.say(this.input.valueAsNumber);
    });
    this.input.addEventListener('change', () => {
      this.held = false;
      chosen(this.input.valueAsNumber);
    });
  }

  show(seconds: number): void {
    this.input.value = String(seconds);
    this.say(seconds);
  }

  private say(seconds: number): void {
    const from = Number(this.input.min);
    const text = `${clock(Math.max(0, seconds - from))} / ${clock(Number(this.input.max) - from)}`;
    say('timeValue', text);
    this.input.setAttribute('aria-valuetext', text);
  }
}

export class TimeLine {
  private readonly line = element('timeLine');
  private readonly slider = new TimeSlider((seconds) => this.choose(seconds));
  private recording: Recording | null = null;
  private soughtAt = -Infinity;

  /** `seek` is called once a choice is made. */
  constructor(private readonly seek: (seconds: number) => void) {}

  /** Of a session that begins. */
  set(recording: Recording | null): void {
    this.recording = recording;
    this.soughtAt = -Infinity;
    this.line.hidden = recording === null;
    if (!recording) return;
    this.slider.input.max = String(recording.length);
    element('marks').replaceChildren(...marksOf(recording).map((mark) => this.markAt(mark)));
    this.line.title = `Recorded on ${new Date(recording.started).toLocaleString()}`;
  }

  show(frame: number, allowed: boolean): void {
    this.slider.input.disabled = !allowed;
    if (!this.recording || this.slider.held || performance.now() - this.soughtAt < patienceMs) return;
    this.slider.show(secondsOf(this.recording, frame));
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
      if (this.slider.input.disabled) return;
      this.slider.show(mark.at);
      this.choose(mark.at);
    });
    return button;
  }
}

/** Of a session that comes from files: a slider over all that is kept, and a button for the present. */
export class AudienceLine {
  private readonly slider: TimeSlider;
  private readonly button = element<HTMLButtonElement>('goLive');
  /** Where a jump goes that is on its way, and since when. */
  private sought: { to: number; at: number } | null = null;

  constructor(client: Pick<Client, 'seek' | 'goLive'>) {
    element('timeLine').hidden = false;
    this.slider = new TimeSlider((to) => {
      this.sought = { to, at: performance.now() };
      client.seek(to);
    });
    this.button.addEventListener('click', () => client.goLive());
  }

  show(line: Kept | null): void {
    const { input } = this.slider;
    input.disabled = line === null;
    this.button.hidden = line === null || line.ended;
    if (!line) return;
    this.button.setAttribute('aria-pressed', String(line.live));
    if (this.slider.held) return;
    input.min = String(line.fromS);
    input.max = String(line.toS);
    if (this.sought && (Math.abs(line.atS - this.sought.to) < 5 || performance.now() - this.sought.at > patienceMs)) this.sought = null;
    this.slider.show(this.sought?.to ?? line.atS);
  }
}
