// The page's messages: a card while there is nothing to see or something is wrong, and a line that disappears.

import { SERVER_GONE, type Status } from '../tandem';
import { element, say } from './elements';

export interface Notice {
  title: string;
  text: string;
  kind: 'wait' | 'bad';
}

/** The message for a status; null while all is well. */
export function noticeOf(status: Pick<Status, 'phase' | 'reason'>, fromFiles = false): Notice | null {
  const { phase, reason } = status;
  switch (phase) {
    case 'connecting':
      return { title: 'Connecting', text: reason || (fromFiles ? 'to the files …' : 'to the gateway …'), kind: 'wait' };
    case 'searching':
      return { title: 'Waiting for the server', text: reason || 'The gateway sees no running session. This page goes on by itself.', kind: 'wait' };
    case 'refused':
      return { title: 'Refused', text: reason || 'The gateway does not let this page in.', kind: 'bad' };
    case 'joining':
      return { title: 'Joining', text: reason || 'A snapshot is on its way …', kind: 'wait' };
    case 'lost':
      if (fromFiles) return { title: 'Waiting for more', text: `${reason}. This page goes on by itself.`, kind: 'wait' };
      return reason !== SERVER_GONE
        ? { title: 'Connection lost', text: `${reason}; trying again`, kind: 'wait' }
        : { title: 'The server is gone', text: 'This page goes on as soon as it is back.', kind: 'wait' };
    case 'closed':
      return { title: 'Closed', text: reason, kind: 'bad' };
    case 'playing':
      return null;
  }
}

/** Why the gateway, or a proxy in front of it, does not take a token; null if it may yet. What a proxy says is not for this page. */
export function loginRefusal(status: number, challenge: string | null, body: string): string | null {
  if (status !== 401 && status !== 403) return null;
  if (status === 401 && challenge?.includes('realm="tandem"')) return body.trim();
  return `A proxy in front of the gateway refused this page (HTTP ${status}). Reload it, and log in where the browser asks.`;
}

export function showNotice(notice: Notice | null): void {
  const state = element('state');
  state.hidden = notice === null;
  if (!notice) return;
  state.dataset.kind = notice.kind;
  say('stateTitle', notice.title);
  say('stateText', notice.text);
}

const toastMs = 4000;
let toastTimer: ReturnType<typeof setTimeout> | undefined;

/** One line that goes away again. */
export function toast(text: string, bad = false): void {
  const line = element('toast');
  line.textContent = text;
  line.classList.toggle('bad', bad);
  line.classList.add('shown');
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => line.classList.remove('shown'), toastMs);
}

/** A ring that spreads from a place of the page. */
export function ripple(x: number, y: number): void {
  const ring = document.createElement('div');
  ring.className = 'ripple';
  ring.style.left = `${x}px`;
  ring.style.top = `${y}px`;
  ring.addEventListener('animationend', () => ring.remove());
  document.body.append(ring);
}
