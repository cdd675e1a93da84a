// Groups of switches of which one is on.

import { colourModes, css, rampColour, type ColourMode, type Colours } from './colours';
import type { BodyType } from '../tandem';
import { element } from './elements';
import { speeds, type Speed } from './slow_motion';

/** Fills a group with one button for each choice; the first is on. */
export function choose<T extends string>(id: string, choices: readonly { value: T; label: string; title: string }[], chosen: (value: T) => void): void {
  const group = element(id);
  choices.forEach(({ value, label, title }, i) => {
    const line = document.createElement('label');
    const input = document.createElement('input');
    Object.assign(input, { type: 'radio', name: id, value, checked: i === 0 });
    input.addEventListener('change', () => chosen(value));
    line.title = title;
    line.append(input, label);
    group.append(line);
  });
}

const titles: Record<ColourMode, string> = {
  type: 'Colour by the type of a body',
  speed: 'Colour by speed',
  corrected: 'Show the bodies that the last delta corrected',
  age: 'Colour by the time since a body was last corrected',
};

export function chooseColours(chosen: (mode: ColourMode) => void): void {
  choose('colours', colourModes.map((value) => ({ value, label: value, title: titles[value] })), chosen);
}

export function chooseSpeed(chosen: (speed: Speed) => void): void {
  const titles: Record<Speed, string> = { '1': 'As it happens', '1/2': 'At half the speed', '1/4': 'At a quarter of the speed' };
  const labels: Record<Speed, string> = { '1': '1×', '1/2': '½', '1/4': '¼' };
  choose('speeds', speeds.map((value) => ({ value, label: labels[value], title: titles[value] })), chosen);
}

/** Explains the colours. */
export function showLegend(colours: Colours, types: BodyType[]): void {
  const legend = colours.legend(types);
  const key = JSON.stringify(legend);
  const target = element('legend');
  if (target.dataset.key === key) return;
  target.dataset.key = key;
  target.replaceChildren();
  if ('names' in legend) {
    for (const [name, colour] of legend.names.slice(0, 8)) {
      const dot = document.createElement('i');
      dot.style.background = css(colour);
      const line = document.createElement('span');
      line.append(dot, name);
      target.append(line);
    }
  } else {
    const bar = document.createElement('span');
    bar.className = 'ramp';
    bar.style.background = `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map((x) => css(rampColour(x))).join(', ')})`;
    target.append(legend.ends[0], bar, legend.ends[1]);
  }
}
