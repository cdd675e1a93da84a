// Plays the files of an audience to a client as a gateway would: the client's WebSocket, without one.

import type { Clock, SocketLike, TimeLine } from '../types';
import { Book, type Place } from './book';
import { Broken, Unplayable, type Passage, type Run } from './manifest';
import { ABSENT, joinAttemptOf, Kind, readSegment, readWhole, type Timed } from './messages';
import { Pace } from './pace';
import { Missing, Store, type Fetch } from './store';

/** Segments are fetched so far ahead of the place that is shown. */
const AHEAD_MS = 3000;
/** Messages, and milliseconds of them, that are given to the client without a pause, in which a page can draw. */
const MOST_AT_ONCE = 24;
const LONGEST_AT_ONCE_MS = 12;
const LIVE_POLL_MS = 970; // a segment comes each second: a little early, and again soon if it was too early
const SOON_POLL_MS = 150;
const LATE_POLL_MS = 1000;
const PAST_POLL_MS = 5000;
/** Another writer may take the folder of one that ended: it is looked for after so long, and then after twice the time. */
const ENDED_POLL_MS = 5000;
const MAX_ENDED_POLL_MS = 60_000;
/** A live manifest that stays the same for so long is looked for past the caches, and again after twice the time: thousands may do so. */
const SUSPECT_MS = 4000;
const MOST_SUSPECT_MS = 32_000;
/** After so long the page says so. */
const SILENT_MS = 8000;
/** As after a time in the background: it does not play all in between. */
const FAR_BEHIND_MS = 15_000;
const MOST_FAILURES = 5;
const CLOSED = 3;
/** Close codes: refused for good, and not. */
const REFUSED = 4005;
const LOST = 1006;

export interface PlayerHost {
  clock: Clock;
  fetch: Fetch;
  log: (line: string) => void;
  /** When the handlers are set. What is fetched before waits for it. */
  ready: Promise<void>;
  /** What comes next is as if of a new connection. */
  reconnected: () => void;
}

interface Loading {
  place: Place;
  run: Run;
  timed: Timed[] | null; // not there yet
}

export class Player implements SocketLike {
  binaryType = '';
  readonly protocol = 'tandem.4';
  readyState = 0;
  onopen: ((event: never) => void) | null = null;
  onmessage: ((event: never) => void) | null = null;
  onclose: ((event: never) => void) | null = null;
  onerror: ((event: never) => void) | null = null;

  /** Why nothing moves, for people; empty while all is well. */
  reason = '';
  readonly #store: Store;
  readonly #pace = new Pace();
  readonly #ended = new AbortController();
  #book: Book | null = null;
  #start = new AbortController();
  #loading: Loading[] = [];
  #last: Place | null = null; // the last that is being loaded
  #run: Run | null = null;
  #passage: Passage | null = null; // at which the client joined
  #snapshot: Uint8Array[] | null = null; // for the client's next request
  #joins = false; // what the client needs to begin is being fetched
  #leftOut: Passage | null = null; // live, until a later one is there
  #sessionSha256 = '';
  #answered = -1;
  #serverMs = 0;
  #shownMs = 0;
  #absent = false;
  #pastCaches = false;
  #newAt = 0;
  #suspectMs = SUSPECT_MS;
  #endedPollMs = ENDED_POLL_MS;
  #failures = 0;
  #more = false; // the chapter that follows is being loaded
  #timer: ReturnType<typeof setTimeout> | undefined;
  #pollTimer: ReturnType<typeof setTimeout> | undefined;

  /** `from`: the folder of the manifest. */
  constructor(
    from: URL,
    private readonly host: PlayerHost,
  ) {
    this.#store = new Store(from, host.fetch);
    void this.#open();
  }

  // --- the client's side

  send(data: Uint8Array): void {
    const attempt = joinAttemptOf(data);
    if (attempt === undefined || attempt === this.#answered) return;
    this.#answered = attempt;
    // Not at once: the client is in the middle of sending.
    if (this.#snapshot) queueMicrotask(() => this.#answer());
    else if (this.#passage && !this.#joins) this.#rejoin(this.#passage);
  }

  close(): void {
    this.readyState = CLOSED;
    this.#ended.abort();
    this.#start.abort();
    clearTimeout(this.#timer);
    clearTimeout(this.#pollTimer);
  }

  /** Goes to a time; what is beyond the end is the present. */
  seek(seconds: number): void {
    const book = this.#book;
    if (!book || this.readyState === CLOSED) return;
    const ms = Math.max(seconds * 1000, book.fromMs);
    if (book.manifest.live && ms > book.toMs - 2500) this.#goTo(null);
    else this.#goTo(Math.min(ms, book.toMs));
  }
  /** Goes to the present or, where there is none, to the end. */
  goLive(): void {
    if (this.#book && this.readyState !== CLOSED) this.#goTo(this.#book.manifest.live ? null : this.#book.toMs);
  }

  timeLine(): TimeLine | null {
    const book = this.#book;
    if (!book) return null;
    const old = this.host.clock.wall() - (this.#serverMs + this.#pace.atMs - this.#shownMs);
    return {
      fromS: book.fromMs / 1000,
      toS: book.toMs / 1000,
      atS: Math.min(this.#pace.atMs, book.toMs) / 1000,
      live: this.#pace.live,
      ended: !book.manifest.live,
      behindMs: this.#pace.live && old >= 0 && old < 60_000 ? old : null,
      receivedBytes: this.#store.receivedBytes,
      refusedFiles: this.#store.refusedFiles,
    };
  }

  // --- begin

  async #open(): Promise<void> {
    try {
      const book = await this.#firstBook();
      if (this.#ended.signal.aborted) return;
      this.#book = book;
      this.#newAt = this.#now();
      this.#goTo(book.manifest.live ? null : book.fromMs);
    } catch (error) {
      this.#end(error);
    }
  }

  async #firstBook(): Promise<Book> {
    const signal = this.#ended.signal;
    // A cache may hold a manifest that is cut short, or what is not one.
    return new Book(
      await this.#store.manifest(false, signal).catch((error: unknown) => {
        if (error instanceof Missing || signal.aborted) throw error;
        return this.#store.manifest(true, signal);
      }),
    );
  }

  /** Plays from a time on, or the present. */
  #goTo(ms: number | null): void {
    const book = this.#book!;
    const age = this.host.clock.wall() - book.manifest.newestMs;
    const atMs = ms ?? Math.max(Pace.first(book.toMs, age), book.fromMs);
    if (book.manifest.live) this.#pollLater(ms === null ? SOON_POLL_MS : PAST_POLL_MS);
    else this.#pollLater(this.#endedPollMs);
    this.#begin(async (signal) => {
      const chapter = book.missing(atMs);
      if (chapter) book.add(chapter, await this.#store.chapter(chapter, signal));
      const passage = book.passageAt(atMs);
      if (!passage) throw new Broken('there is nothing to play yet');
      await this.#join(passage, Math.max(atMs, passage.fromMs), ms === null, signal);
    });
  }
  #goToPassage(passage: Passage): void {
    const live = this.#pace.live;
    this.#begin((signal) => this.#join(passage, Math.max(this.#pace.atMs, passage.fromMs), live, signal));
  }

  /** Does something in the place of what was begun before. */
  #begin(what: (signal: AbortSignal) => Promise<void>): void {
    this.#start.abort();
    const { signal } = (this.#start = new AbortController());
    this.#joins = true;
    what(signal).catch((error: unknown) => !signal.aborted && this.#fail(error));
  }

  /** Has the client begin anew with a passage's snapshot, and go on to a time. */
  async #join(passage: Passage, atMs: number, live: boolean, signal: AbortSignal): Promise<void> {
    const run = this.#book!.run(passage);
    if (!run) throw new Broken('the manifest lacks a run');
    this.#loading = [];
    this.#last = Book.before(passage);
    this.#snapshot = null;
    this.#leftOut = null;
    this.#passage = passage;
    this.#run = run;
    this.#pace.goTo(atMs, this.#now());
    this.#pace.live = live;
    const needed = Promise.all([
      this.#session(run, signal),
      this.#store.object(passage.snapshot, signal).then((bytes) => this.#store.read(() => readWhole(bytes, Kind.snapshot, run))),
    ]);
    this.#load(signal); // asked for behind them, because a browser asks a server for few things at once
    const [session, snapshot] = await needed;
    await this.host.ready;
    if (signal.aborted) return;
    this.#snapshot = snapshot;
    this.#joins = false;
    this.#shownMs = passage.fromMs;
    this.#serverMs = 0;
    this.#absent = false;
    if (this.readyState === 0) {
      this.readyState = 1;
      this.onopen?.({} as never);
    } else {
      this.host.reconnected();
    }
    this.#announce(run, session);
  }

  async #session(run: Run, signal: AbortSignal): Promise<Uint8Array[]> {
    const bytes = await this.#store.object(run.session, signal);
    return this.#store.read(() => readWhole(bytes, Kind.session, run));
  }
  #announce(run: Run, session: Uint8Array[]): void {
    this.#sessionSha256 = run.session.sha256;
    for (const message of session) this.#give(message);
  }

  #answer(): void {
    for (const message of this.#snapshot ?? []) this.#give(message);
    this.#snapshot = null;
    this.#pump();
  }

  /** The client lost its state, as after a frame that it computes otherwise: it goes on from the next snapshot, if there is one. */
  #rejoin(from: Passage): void {
    const book = this.#book!;
    this.#goToPassage(book.passageAfter(from) ?? book.passageAt(from.fromMs) ?? from);
  }

  // --- go on

  /** Fetches what is not far ahead. */
  #load(signal: AbortSignal): void {
    const book = this.#book!;
    while (this.#last && !signal.aborted) {
      const doneMs = this.#last.index < 0 ? this.#last.passage.fromMs : endOf(this.#last);
      if (doneMs > this.#pace.atMs + AHEAD_MS) return;
      const chapter = book.missing(this.#last.passage.fromMs) ?? book.missing(doneMs);
      if (chapter) return void this.#loadChapter(chapter, signal);
      const place = book.next(this.#last);
      const run = place && book.run(place.passage);
      if (!place || !run) return;
      this.#last = place;
      const loading: Loading = { place, run, timed: null };
      this.#loading.push(loading);
      const segment = Book.segment(place);
      this.#store
        .object(segment.object, signal)
        .then((bytes) => {
          loading.timed = this.#store.read(() => readSegment(bytes, segment, run));
          this.#pump();
        })
        .catch((error: unknown) => {
          if (!signal.aborted) this.#skip(place, error);
        });
    }
  }

  #loadChapter(chapter: Parameters<Book['add']>[0], signal: AbortSignal): void {
    if (this.#more) return;
    this.#more = true;
    this.#store
      .chapter(chapter, signal)
      .then((passages) => this.#book!.add(chapter, passages))
      .catch((error: unknown) => !signal.aborted && this.#fail(error))
      .finally(() => {
        this.#more = false;
        if (!signal.aborted) this.#pump();
      });
  }

  /** Goes on behind a segment that cannot be had: with the next snapshot, once there is one. */
  #skip({ passage }: Place, error: unknown): void {
    if (this.#leftOut) return;
    this.host.log(`left out a part: ${text(error)}`);
    if (++this.#failures > MOST_FAILURES) return this.#end(error);
    const after = this.#book!.passageAfter(passage);
    if (after) return this.#goToPassage(after);
    if (!this.#pace.live) return this.#end(error);
    this.#leftOut = passage;
    this.#last = null;
  }

  /** Gives the client what is due, and comes back when more is. */
  #pump(): void {
    clearTimeout(this.#timer);
    if (this.readyState !== 1 || this.#joins || this.#snapshot || !this.#book) return;
    const began = this.#now();
    this.#pace.advance(began, this.#endMs());
    for (let given = 0; this.#loading[0]?.timed; ++given) {
      const { run, timed } = this.#loading[0];
      if (timed.length === 0) {
        this.#passage = this.#loading.shift()!.place.passage;
        continue;
      }
      const first = timed[0]!;
      if (first.atMs > this.#pace.atMs) break;
      // Another server, or the same after a gap.
      if (run.run !== this.#run?.run) return this.#goToPassage(this.#loading[0].place.passage);
      if (given >= MOST_AT_ONCE || this.#now() - began > LONGEST_AT_ONCE_MS) {
        this.#timer = setTimeout(() => this.#pump(), 0);
        return;
      }
      this.#shownMs = first.atMs;
      this.#serverMs = first.serverMs;
      timed.shift();
      this.#failures = 0;
      this.#give(first.message);
      if (this.readyState !== 1 || this.#snapshot) return;
    }
    this.#load(this.#start.signal);
    const next = this.#loading[0]?.timed?.[0];
    if (!this.#pace.live && this.#loading.length === 0 && this.#book.manifest.live && this.#pace.atMs >= this.#book.toMs) {
      this.#pace.live = true; // it has come up to the present
      this.#pollLater(SOON_POLL_MS);
    }
    const waitMs = next && !this.#pace.dry ? Math.min(Math.max(next.atMs - this.#pace.atMs, 1), 200) : 50;
    this.#timer = setTimeout(() => this.#pump(), waitMs);
  }

  /** Up to where everything is there. */
  #endMs(): number {
    let endMs = this.#pace.atMs;
    for (const { place, timed } of this.#loading) {
      if (!timed) break;
      endMs = Math.max(endMs, endOf(place));
    }
    return endMs;
  }

  #give(message: Uint8Array): void {
    this.onmessage?.({ data: message.slice().buffer } as never);
  }

  // --- manifests

  #pollLater(ms: number): void {
    clearTimeout(this.#pollTimer);
    if (this.readyState !== CLOSED) this.#pollTimer = setTimeout(() => void this.#poll(), ms);
  }

  async #poll(): Promise<void> {
    const book = this.#book!;
    const began = this.#now();
    const quietMs = began - this.#newAt;
    const suspects = book.manifest.live && quietMs > this.#suspectMs;
    if (suspects) this.#suspectMs = Math.min(2 * this.#suspectMs, this.#suspectMs + MOST_SUSPECT_MS);
    let trouble = '';
    let news: 'newer' | 'same' | 'stale' | 'another' = 'same';
    try {
      const manifest = await this.#store.manifest(this.#pastCaches || suspects, this.#ended.signal);
      news = book.take(manifest);
      if (news === 'stale') ++this.#store.refusedFiles;
      if (news === 'another') return void this.#follow(new Book(manifest));
      if (news === 'newer' && suspects && !this.#pastCaches) await this.#blameCache(manifest.number);
    } catch (error) {
      if (this.#ended.signal.aborted) return;
      // Cut short or gone for a moment; what is held is played meanwhile.
      trouble = text(error);
    }
    if (this.readyState === CLOSED) return;
    if (news === 'newer') this.#grew();
    if (!book.manifest.live) {
      this.#pollLater(this.#endedPollMs);
      this.#endedPollMs = Math.min(2 * this.#endedPollMs, MAX_ENDED_POLL_MS);
      return;
    }
    if (news !== 'newer' && quietMs > SILENT_MS && this.#pace.live) this.#say(trouble || `nothing new has come for ${Math.round(quietMs / 1000)} s`);
    if (!this.#pace.live) return this.#pollLater(PAST_POLL_MS);
    if (news === 'newer' && !suspects) return this.#pollLater(Math.max(LIVE_POLL_MS - (this.#now() - began), SOON_POLL_MS));
    this.#pollLater(quietMs > SUSPECT_MS ? LATE_POLL_MS : SOON_POLL_MS);
  }

  // Was it the cache that was silent, or the origin?
  async #blameCache(number: number): Promise<void> {
    const cached = await this.#store.manifest(false, this.#ended.signal).catch(() => null);
    if (cached && cached.number >= number) return;
    this.#pastCaches = true;
    this.host.log('a cache serves an old manifest; it is passed by');
  }

  #grew(): void {
    const book = this.#book!;
    this.#newAt = this.#now();
    this.#suspectMs = SUSPECT_MS;
    this.#pace.grew(book.toMs);
    this.reason = '';
    this.#tellNames();
    const after = this.#leftOut && book.passageAfter(this.#leftOut);
    if (this.#absent || (this.#pace.live && book.toMs - this.#pace.atMs > FAR_BEHIND_MS)) this.#goTo(null);
    else if (after) this.#goToPassage(after);
    else this.#pump();
  }

  /** Bodies may get other names while a run goes on. */
  #tellNames(): void {
    const run = this.#passage && this.#book!.run(this.#passage);
    if (!run || run.run !== this.#run?.run || run.session.sha256 === this.#sessionSha256 || this.#joins || this.#snapshot) return;
    const { signal } = this.#start;
    this.#sessionSha256 = run.session.sha256;
    this.#session(run, signal)
      .then((session) => !signal.aborted && this.#announce(run, session))
      .catch((error: unknown) => !signal.aborted && this.host.log(text(error)));
  }

  /** A writer that began later has the folder. */
  #follow(book: Book): void {
    this.#book = book;
    this.#newAt = this.#now();
    this.#suspectMs = SUSPECT_MS;
    this.#endedPollMs = ENDED_POLL_MS;
    this.#absent = false;
    this.reason = '';
    this.#goTo(book.manifest.live ? null : book.fromMs);
  }

  /** Tells the client that its server is silent; what is shown stays. */
  #say(reason: string): void {
    this.reason = reason;
    if (this.#absent || this.#endMs() > this.#pace.atMs) return;
    this.#absent = true;
    this.#give(ABSENT);
  }

  // --- errors

  /** Something that was to be played next is not there. */
  #fail(error: unknown): void {
    if (++this.#failures > MOST_FAILURES || !this.#book?.manifest.live) return this.#end(error);
    this.host.log(text(error));
    const start = this.#start;
    setTimeout(() => !start.signal.aborted && start === this.#start && this.#goTo(null), 1000);
  }

  #end(error: unknown): void {
    if (this.readyState === CLOSED) return;
    this.close();
    void this.host.ready.then(() => this.onclose?.({ code: error instanceof Unplayable ? REFUSED : LOST, reason: text(error) } as never));
  }

  #now(): number {
    return this.host.clock.steady();
  }
}

function endOf(place: Place): number {
  const segment = Book.segment(place);
  return segment.fromMs + segment.ms;
}

function text(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
