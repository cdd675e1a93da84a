// The switch that shows the prediction without corrections, and what that means.

import type { Status } from '../tandem';
import { element, threeDigits } from './elements';

/** Describes the picture without corrections; empty with corrections. */
export function driftLine({ uncorrected, frameRateHz, phase }: Pick<Status, 'uncorrected' | 'frameRateHz' | 'phase'>): string {
  if (!uncorrected) return phase === 'playing' ? '' : 'Without corrections, from the next join on.';
  const { frames, meanDrift, mostDrift } = uncorrected;
  const seconds = frameRateHz > 0 ? frames / frameRateHz : 0;
  return (
    `Prediction alone for ${threeDigits(seconds)} s: no body has been corrected, and on average they have drifted by ` +
    `${threeDigits(meanDrift)} m, at most by ${threeDigits(mostDrift)} m. The figures are still those of the session.`
  );
}

export class CorrectionsSwitch {
  private on = true;

  constructor(changed: (on: boolean) => void) {
    const button = element('corrections');
    button.addEventListener('click', () => {
      this.on = !this.on;
      button.setAttribute('aria-checked', String(this.on));
      element('drift').hidden = this.on;
      changed(this.on);
    });
  }

  show(status: Status): void {
    if (!this.on) element('drift').textContent = driftLine(status);
  }
}
