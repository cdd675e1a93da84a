// The figures beside the world.

import type { Status, TimeLine } from '../tandem';
import { adviceOf } from './advice';
import { element, say, threeDigits } from './elements';
import { History } from './history';

const historyLength = 240;
const plots = { rate: '#7cc7ff', corrected: '#ffb03b', lag: '#5fd38d', work: '#c3a6ff' };
type Plot = keyof typeof plots;

const count = (value: number) => value.toLocaleString('en');

/** Frames drawn in the last second, how long drawing them took, and what they lack. */
export interface Drawing {
  framesPerSecond: number;
  msP50: number;
  leftOut: string;
}

export class Panel {
  private readonly histories = Object.fromEntries(
    Object.keys(plots).map((plot) => [plot, new History(historyLength)]),
  ) as Record<Plot, History>;

  constructor() {
    const more = element('more');
    more.addEventListener('click', () => {
      const open = element('panel').classList.toggle('open');
      more.setAttribute('aria-expanded', String(open));
    });
  }

  /** Begins a new run of the server, which is not compared with the last one. */
  clear(): void {
    for (const history of Object.values(this.histories)) history.clear();
  }

  update(status: Status, drawing: Drawing): void {
    const playing = status.phase === 'playing';
    const phase = element('phase');
    phase.textContent = status.phase;
    phase.dataset.phase = status.phase;
    say('scene', status.scene);
    say('rate', threeDigits(status.mbitPerS));
    const share = status.rawMbitPerS > 0 ? (100 * status.mbitPerS) / status.rawMbitPerS : 0;
    say('raw', status.rawMbitPerS > 0 ? `${threeDigits(share)} % of ${threeDigits(status.rawMbitPerS)} raw, ${threeDigits(status.wireMbitPerS)} on the wire` : '');
    say('corrected', count(status.corrected));
    say('bodies', `of ${count(status.bodies)} bodies, ${count(status.atRest)} at rest`);
    const behindMs = status.timeLine ? status.timeLine.behindMs : status.lagMs;
    say('lag', behindMs === null ? '–' : threeDigits(behindMs));
    say('roundTrip', status.timeLine ? bytesLine(status.timeLine) : `round trip ${threeDigits(status.roundTripMs)} ms`);
    say('work', threeDigits(status.frameMs.p50));
    say('drawing', `p99 ${threeDigits(status.frameMs.p99)} · ${drawing.framesPerSecond.toFixed(0)} pictures a second`);
    say('advice', adviceOf(status));
    say('hashHex', status.stateHash || '–');
    const good = hashIsGood(status);
    element('hash').dataset.good = good === null ? '' : good ? 'yes' : 'no';
    say('hashState', good === null ? '–' : good ? 'equal to the server’s' : `${count(status.hashMismatches)} mismatches`);
    say('hashNote', `${count(status.framesApplied)} frames applied, ${count(status.hashMismatches)} mismatches${status.resyncs ? `, ${status.resyncs} rejoins` : ''}`);
    say('session', sessionLine(status));
    if (playing) {
      this.histories.rate.add(status.mbitPerS);
      this.histories.corrected.add(status.corrected);
      if (behindMs !== null) this.histories.lag.add(behindMs);
      this.histories.work.add(status.frameMs.p50);
    }
    for (const figure of document.querySelectorAll<HTMLElement>('[data-plot]')) {
      const plot = figure.dataset.plot as Plot;
      const canvas = figure.querySelector('canvas');
      if (canvas) this.histories[plot].draw(canvas, plots[plot]);
    }
  }
}

/** Whether the state is the server's; null while nobody can tell. */
export function hashIsGood({ phase, framesApplied, hashMismatches }: Pick<Status, 'phase' | 'framesApplied' | 'hashMismatches'>): boolean | null {
  if (hashMismatches > 0) return false;
  return phase === 'playing' && framesApplied > 0 ? true : null;
}

function bytesLine({ live, receivedBytes, refusedFiles }: TimeLine): string {
  const refused = refusedFiles > 0 ? `, ${several(refusedFiles, 'file')} refused` : '';
  return `${live ? 'behind the server' : 'in the past'}, ${threeDigits(receivedBytes / 1e6)} MB fetched${refused}`;
}

function sessionLine(status: Status): string {
  const parts = [`frame ${count(status.frame)} at ${threeDigits(status.frameRateHz)} Hz`, `${status.codec}, ${status.predictor}`];
  if (status.server) {
    const { participants, observers } = status.server;
    parts.push(`${several(participants, 'participant')}, ${several(observers, 'observer')}`);
  }
  parts.push(`here: ${status.role}${status.simd ? ', with SIMD' : ''}`);
  return parts.join(' · ');
}

function several(number: number, what: string): string {
  return `${count(number)} ${what}${number === 1 ? '' : 's'}`;
}
