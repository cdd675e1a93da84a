// What begins when the page is opened: the session and its module are fetched, and the graphics context is made, while the rest of the
// page (`page.ts`, with three.js) is still on its way. `performance` has a mark for each step.

import { Client, type ConnectOptions, type LogLevel, type Role } from '../tandem';
import { surfaceOn, type Surface } from './drawing/surface';
import { element } from './elements';
import { loginRefusal, noticeOf, showNotice, toast, type Notice } from './notices';

/** So long the files that a manifest names are waited for to be asked for, before the rest of the page is begun. */
const manifestMs = 100;

/** The gateway's address, made of the page's own. */
function gatewayUrl(): string {
  const url = new URL('tandem', document.baseURI);
  url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
  return url.href;
}

/** Takes the token out of the page's address: #token=TOKEN, or ?token=TOKEN. Null if there is none. */
function takeToken(): string | null {
  const url = new URL(location.href);
  const behind = new URLSearchParams(url.hash.slice(1));
  const token = behind.get('token') ?? url.searchParams.get('token');
  if (token === null) return null;
  behind.delete('token');
  url.searchParams.delete('token');
  url.hash = behind.toString();
  history.replaceState(history.state, '', url);
  return token;
}

/** Hands the token to the gateway, which has the browser keep it in a cookie that no script reads. */
async function logIn(token: string): Promise<void> {
  const login = new URL('login', document.baseURI);
  for (let waitMs = 250; ; waitMs = Math.min(2 * waitMs, 5000)) {
    // Not in Authorization, where the browser may have to show what a proxy asks for.
    const answer = await fetch(login, { headers: { 'Tandem-Token': token }, cache: 'no-store' }).catch(() => null);
    if (answer?.ok) return;
    const refusal = answer && loginRefusal(answer.status, answer.headers.get('WWW-Authenticate'), await answer.text());
    if (refusal) throw new Refused(refusal);
    await new Promise((resolve) => setTimeout(resolve, waitMs));
  }
}

class Refused extends Error {}

/** Fetches; `asked` resolves when more than the manifest of a session has been asked for. */
function watchedFetch(): { fetch: NonNullable<ConnectOptions['fetch']>; asked: Promise<void> } {
  let tell: () => void = () => undefined;
  const asked = new Promise<void>((resolve) => (tell = resolve));
  return {
    fetch: (url, options) => {
      if (!url.pathname.endsWith('/manifest.json')) setTimeout(tell, 0); // not before its neighbours are asked for too
      return fetch(url, options);
    },
    asked,
  };
}

function surface(): Surface {
  const made = surfaceOn(element<HTMLCanvasElement>('world'));
  if (!made) throw new Error('This browser has no WebGL 2, with which the bodies are drawn.');
  performance.mark('tandem-surface');
  return made;
}

async function start(): Promise<void> {
  if (typeof WebAssembly !== 'object') {
    throw new Error('This browser has no WebAssembly, in which the client is written.');
  }
  performance.mark('tandem-began');
  const asked = new URLSearchParams(location.search);
  const role: Role = asked.has('observe') ? 'observer' : 'participant';
  document.body.classList.toggle('bare', asked.has('bare'));
  const wasm = { plain: new URL('tandem.wasm', document.baseURI), simd: new URL('tandem-simd.wasm', document.baseURI) };
  const log = (level: LogLevel, text: string) => void (level !== 'info' && toast(text, true));
  // A link with another token, opened in this page, changes only what is behind the #.
  addEventListener('hashchange', () => location.hash.includes('token=') && location.reload());
  const token = takeToken();
  if (token !== null) await logIn(token);
  const from = asked.get('from');
  const where = from === null ? { url: gatewayUrl(), role } : { from };
  const watched = watchedFetch();
  const connected = Client.connect({ ...where, wasm, log, fetch: watched.fetch });
  void connected.then(
    () => performance.mark('tandem-client'),
    () => undefined,
  );
  const drawable = async () => {
    const page = import('./page');
    // Making a context takes up to a second in a browser that has just started. Nothing else happens meanwhile but that files come.
    const made = surface();
    if (from !== null) await Promise.race([watched.asked, new Promise((resolve) => setTimeout(resolve, manifestMs))]);
    const { drawableOn } = await page;
    return drawableOn(made);
  };
  const [client, open] = await Promise.all([connected, drawable()]);
  Object.assign(globalThis, { tandem: open(client, from !== null).forScripts });
}

showNotice(noticeOf({ phase: 'connecting', reason: '' }, new URLSearchParams(location.search).has('from')));
start().catch((error: unknown) => {
  const title = error instanceof Refused ? 'Refused' : 'This page cannot run';
  const notice: Notice = { title, text: error instanceof Error ? error.message : String(error), kind: 'bad' };
  showNotice(notice);
  throw error;
});
