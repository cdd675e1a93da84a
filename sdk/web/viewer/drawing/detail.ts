// Chooses in how much detail the world is drawn, from how fast pictures follow each other.

export interface Detail {
  /** Pixels of the canvas to one of the page. */
  pixelRatio: number;
  /** Spheres are flat discs. */
  discs: boolean;
}

const mostPixelRatio = 2;
const slowFrameMs = 36;
const quickFrameMs = 25;
/** A longer pause says nothing about the pictures before and after it. */
const longestFrameMs = 100;
/** Of what a picture took before, so much counts: pictures come at multiples of the screen's period, now a longer and now a shorter one. */
const memory = 0.85;
/** So many in a row, and it changes. */
const slowFrames = 20;
const quickFrames = 120;
/** For more spheres than these, software that draws a sprite for each takes so long that it is not tried. */
const manyBodies = 30_000;

/** All there is to choose from, the finest first. */
export function detailsOf(devicePixelRatio: number, software: boolean): Detail[] {
  const details: Detail[] = [];
  let pixelRatio = Math.min(devicePixelRatio, mostPixelRatio);
  for (; pixelRatio > 1; pixelRatio *= 0.75) details.push({ pixelRatio, discs: false });
  details.push({ pixelRatio: Math.min(devicePixelRatio, 1), discs: false });
  if (software) for (const coarse of [1, 0.75, 0.5]) details.push({ pixelRatio: Math.min(devicePixelRatio, coarse), discs: true });
  return details;
}

export class DetailChoice {
  private readonly details: Detail[];
  private finest = 0;  // that is tried
  private level: number;
  private slow = 0;
  private quick = 0;
  private patience = quickFrames;
  private typicalMs = 0;

  constructor(devicePixelRatio: number, software: boolean) {
    this.details = detailsOf(devicePixelRatio, software);
    this.level = this.firstDiscs();
  }

  /** Where there are discs, they come first, because a picture of them is there sooner. */
  private firstDiscs(): number {
    return Math.max(this.details.findIndex((detail) => detail.discs), 0);
  }

  get now(): Detail {
    return this.details[this.level];
  }

  /** Begins with a session of so many bodies. */
  begin(bodies: number): void {
    this.finest = bodies > manyBodies ? this.firstDiscs() : 0;
    this.level = Math.max(this.level, this.finest);
    this.slow = this.quick = this.typicalMs = 0;
  }

  /** Takes the time between two pictures; true if the detail is another one now. */
  note(frameMs: number): boolean {
    const ms = Math.min(frameMs, longestFrameMs);
    this.typicalMs = this.typicalMs === 0 ? ms : memory * this.typicalMs + (1 - memory) * ms;
    this.slow = this.typicalMs > slowFrameMs ? this.slow + 1 : 0;
    this.quick = this.typicalMs < quickFrameMs ? this.quick + 1 : 0;
    const before = this.level;
    if (this.slow >= slowFrames && this.level + 1 < this.details.length) {
      ++this.level;
      this.patience *= 2;  // what was too much before is tried again, but ever more rarely
    } else if (this.quick >= this.patience && this.level > this.finest) {
      --this.level;
    }
    if (this.level !== before) this.slow = this.quick = this.typicalMs = 0;
    return this.level !== before;
  }

  /** What is left out, for people; empty where nothing is. */
  leftOut(hasSpheres: boolean): string {
    const { pixelRatio, discs } = this.now;
    const parts = [];
    if (discs && hasSpheres) parts.push('spheres as flat discs');
    const share = pixelRatio / this.details[0].pixelRatio;
    if (share < 1) parts.push(`${Math.round(100 * share * share)} % of the pixels`);
    return parts.length > 0 ? `Less detail, to keep up: ${parts.join(', ')}` : '';
  }
}
