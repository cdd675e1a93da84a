// The time line of an audience: what manifests and chapters say, put together.

import type { Chapter, Manifest, Passage, Run, Segment } from './manifest';

/** A segment and where it stands. */
export interface Place {
  passage: Passage;
  index: number;
}

function last<T>(list: T[], fits: (each: T) => boolean): T | undefined {
  for (let i = list.length - 1; i >= 0; --i) if (fits(list[i]!)) return list[i];
  return undefined;
}

/** What a new manifest is to the one that is held. */
export type News = 'newer' | 'same' | 'stale' | 'another';

export class Book {
  readonly #chapters = new Map<string, Passage[]>();

  constructor(private held: Manifest) {}

  get manifest(): Manifest {
    return this.held;
  }
  get fromMs(): number {
    return (this.held.chapters[0] ?? this.held.passages[0])!.fromMs;
  }
  get toMs(): number {
    return this.held.passages.at(-1)!.toMs;
  }

  /** Takes a manifest that is newer. One of a writer that began later is `another`: nothing of the old one fits it. */
  take(manifest: Manifest): News {
    if (manifest.writer !== this.held.writer) return manifest.writer > this.held.writer ? 'another' : 'stale';
    if (manifest.number === this.held.number) return 'same';
    if (manifest.number < this.held.number) return 'stale';
    this.held = manifest;
    const named = new Set(manifest.chapters.map(({ object }) => object.sha256));
    for (const sha256 of this.#chapters.keys()) if (!named.has(sha256)) this.#chapters.delete(sha256);
    return 'newer';
  }

  /** The chapter that has to be loaded before what is at `ms` is known; none where nothing is missing. */
  missing(ms: number): Chapter | undefined {
    const first = this.held.passages[0]!;
    if (ms >= first.fromMs) return undefined;
    const { chapters } = this.held;
    const chapter = last(chapters, ({ fromMs }) => fromMs <= ms) ?? chapters[0];
    return chapter && !this.#chapters.has(chapter.object.sha256) ? chapter : undefined;
  }
  add(chapter: Chapter, passages: Passage[]): void {
    this.#chapters.set(chapter.object.sha256, passages);
  }

  run(passage: Passage): Run | undefined {
    return this.held.runs.get(passage.run);
  }

  /** The passage from which to begin for `ms`: the last that begins by then and has a segment, or else the first after it. */
  passageAt(ms: number): Passage | undefined {
    const passages = [...this.#around(ms), ...this.held.passages].filter(({ segments }) => segments.length > 0);
    return last(passages, ({ fromMs }) => fromMs <= ms) ?? passages[0];
  }

  /** The first passage that begins behind one. */
  passageAfter({ fromMs, frame, run }: Passage): Passage | undefined {
    const passages = [...this.#around(fromMs), ...this.#around(this.#endOfChapter(fromMs)), ...this.held.passages];
    return passages.find(
      (other) => other.segments.length > 0 && (other.fromMs > fromMs || (other.fromMs === fromMs && (other.run > run || other.frame > frame))),
    );
  }

  /** The segment behind a place, as far as it is known now. `missing()` of its end says whether more could be. */
  next({ passage, index }: Place): Place | undefined {
    // A passage of an older manifest may have grown since.
    const now = this.#again(passage);
    if (now && index + 1 < now.segments.length) return { passage: now, index: index + 1 };
    const after = this.passageAfter(passage);
    return after && { passage: after, index: 0 };
  }
  /** The place in front of a passage. */
  static before(passage: Passage): Place {
    return { passage, index: -1 };
  }
  static segment({ passage, index }: Place): Segment {
    return passage.segments[index]!;
  }

  #again({ fromMs, frame, run }: Passage): Passage | undefined {
    return [...this.#around(fromMs), ...this.held.passages].find(
      (other) => other.fromMs === fromMs && other.frame === frame && other.run === run,
    );
  }
  #endOfChapter(ms: number): number {
    return last(this.held.chapters, ({ fromMs }) => fromMs <= ms)?.toMs ?? ms;
  }
  /** The passages of the chapter at `ms`, if it is loaded. */
  #around(ms: number): Passage[] {
    if (ms >= this.held.passages[0]!.fromMs) return [];
    const chapter = last(this.held.chapters, ({ fromMs }) => fromMs <= ms) ?? this.held.chapters[0];
    return (chapter && this.#chapters.get(chapter.object.sha256)) ?? [];
  }
}
