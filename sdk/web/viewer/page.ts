// The page, once the client is there: draws the session's bodies, shows its figures, and sends the user's inputs. It has three.js, the
// largest of what the browser loads; `main.ts` has what must not wait for it.

import type { Client, OutcomeEvent, Sample, SampleMode, Status } from '../tandem';
import { chooseColours, chooseSpeed, showLegend } from './choices';
import type { ColourMode } from './colours';
import { CorrectionsSwitch } from './corrections';
import { GravityControls } from './gravity_controls';
import { element, say, threeDigits } from './elements';
import { noticeOf, ripple, showNotice, toast } from './notices';
import { Panel, type Drawing } from './panel';
import { pick } from './pick';
import type { Vec3 } from './scene';
import type { Speed } from './slow_motion';
import { Stage } from './drawing/stage';
import type { Surface } from './drawing/surface';
import { warmUp } from './drawing/warm_up';
import { AudienceLine, TimeLine } from './time_line';
import { World } from './world';

const figuresEveryMs = 250;
const tapMs = 350;
const tapPixels = 8;
/** A push takes the neighbours along: its reach in radii of the body. */
const pushReachRadii = 3;
/** Radii a second; the server's own limit, where the scene names none, is 100. */
const pushRadiiPerS = 30;

class Page {
  private readonly panel = new Panel();
  private readonly gravity: GravityControls;
  private readonly audienceLine: AudienceLine | null = null;
  private readonly timeLine = new TimeLine((seconds) => this.send('seek', () => this.client.sendSeek(seconds)));
  private readonly corrections: CorrectionsSwitch;
  private world: World | null = null;
  private sceneShown = '';
  private sessionChanged = true;
  private epoch = 0;
  private applied = 0;
  private colourMode: ColourMode = 'type';
  private speed: Speed = '1';
  private radii: number[] = [];
  private readonly sent = new Map<number, string>();
  private readonly drawn: { at: number; ms: number }[] = [];
  private figuresAt = 0;
  private seen = false;

  constructor(
    private readonly client: Client,
    private readonly stage: Stage,
    fromFiles: boolean,
  ) {
    document.body.classList.toggle('audience', fromFiles);
    if (fromFiles) this.audienceLine = new AudienceLine(client);
    this.gravity = new GravityControls(
      () => this.stage.axes().map((axis) => axis.toArray()) as [Vec3, Vec3, Vec3],
      (gravity) => this.send('gravity', () => this.client.sendGravity(gravity)),
    );
    chooseColours((mode) => {
      this.colourMode = mode;
      this.panelsChanged();
    });
    chooseSpeed((speed) => {
      this.speed = speed;
      this.world?.slowMotion.setSpeed(speed);
    });
    this.corrections = new CorrectionsSwitch((on) => {
      client.showUncorrected(!on);
      this.panelsChanged();
    });
    this.followTaps(stage.canvas);
    element('reframe').addEventListener('click', () => this.world && this.stage.frame(this.world.extent));
    new ResizeObserver(() => this.panelsChanged()).observe(element('panel'));
    new ResizeObserver(() => this.panelsChanged()).observe(element('controls'));
    client.on('session', ({ epoch }) => this.sessionBegan(epoch));
    client.on('applied', ({ frame }) => (this.applied = frame));
    client.on('outcome', (outcome) => this.showOutcome(outcome));
    client.on('phase', () => (this.figuresAt = 0));
    // The first picture waits for no other of the browser's, which may be busy with those of the warm-up.
    client.on('phase', (phase) => phase === 'playing' && !this.seen && this.draw(performance.now()));
    this.epoch = client.status().epoch;
    this.draw(performance.now());
    requestAnimationFrame((now) => this.drawAndGoOn(now));
  }

  /** The object that scripts see as globalThis.tandem. */
  readonly forScripts = {
    status: (): Status & { drawing: Drawing } => ({ ...this.client.status(), drawing: this.drawing() }),
    sample: (mode?: SampleMode) => this.sample(mode),
    project: (point: Vec3) => this.stage.project(point),
    seek: (seconds: number) => this.client.seek(seconds),
    goLive: () => this.client.goLive(),
  };

  /** Besides the one of every picture. */
  private sample(mode?: SampleMode): Sample | null {
    const sample = this.client.sample(mode);
    if (sample) this.world?.note(sample);
    return sample;
  }

  private sessionBegan(epoch: number): void {
    // Files have a new session with each jump.
    const restarted = this.epoch !== 0 && epoch !== this.epoch && !this.world?.scene.recording;
    if (restarted) toast('The server was restarted: a new run has begun');
    this.epoch = epoch;
    this.sessionChanged = true;
    this.applied = 0;
    this.panel.clear();
    this.sent.clear();
  }

  private drawAndGoOn(now: number): void {
    requestAnimationFrame((next) => this.drawAndGoOn(next));
    this.draw(now);
  }

  private draw(now: number): void {
    const began = performance.now();
    this.updateWorld(now);
    this.gravity.draw();
    this.world?.beforeRender();
    if (this.world) this.stage.render(now);
    if (this.world && !this.seen) performance.mark('tandem-rendered');
    if (this.world && !this.seen) this.stage.whenDrawn(() => performance.mark('tandem-first-picture'));
    this.seen = this.world !== null;
    this.drawn.push({ at: now, ms: performance.now() - began });
    while (this.drawn.length > 1 && this.drawn[0].at <= now - 1000) this.drawn.shift();
    if (now >= this.figuresAt + figuresEveryMs) {
      this.figuresAt = now;
      this.showFigures();
    }
  }

  private updateWorld(now: number): void {
    const types = this.sessionChanged ? this.client.types() : [];
    const scene = this.sessionChanged ? this.client.sceneJson() : '';
    // Any call of the client may end the sample's views, so what else is wanted of it comes first.
    const up = this.sessionChanged || !this.world ? this.client.status().upAxis : 1;
    const sample = this.client.sample('extrapolate');
    if (!sample) return;
    if (this.sessionChanged || !this.world) {
      if (!this.world) performance.mark('tandem-sample');
      this.world?.dispose();
      this.stage.setUp(up ?? 1);
      this.world = new World(this.stage, types, scene, sample, up ?? 1);
      this.world.slowMotion.setSpeed(this.speed);
      this.stage.begin(sample.capacity);
      this.sessionChanged = false;
      this.radii = types.map((type) => type.radius);
      this.gravity.setScene(this.world.scene);
      element('scene').title = this.world.scene.description;
      if (this.world.sceneError) toast(`The scene’s geometry cannot be drawn: ${this.world.sceneError}`, true);
      if (!this.audienceLine) this.timeLine.set(this.world.scene.recording);
      // A replay announces its place with each jump.
      const shown = JSON.stringify({ ...this.world.scene, recording: null });
      if (shown !== this.sceneShown || scene === '') this.stage.frame(this.world.extent);
      this.sceneShown = shown;
    }
    this.world.colours.mode = this.colourMode;
    const shown = this.world.slowMotion.play(sample, this.applied, now);
    this.world.update(shown.sample, shown.applied, this.stage.detail.discs);
  }

  private showFigures(): void {
    const status = this.client.status();
    this.panel.update(status, this.drawing());
    this.corrections.show(status);
    if (Math.hypot(...status.gravity) > 0) this.gravity.show(status.gravity);
    const allowed = status.phase === 'playing' && status.role === 'participant';
    this.gravity.setAllowed(allowed);
    if (this.audienceLine) this.audienceLine.show(status.timeLine);
    else this.timeLine.show(this.applied, allowed);
    if (this.world) showLegend(this.world.colours, this.world.types);
    const leftOut = this.leftOut();
    element('leftOut').hidden = leftOut === '';
    say('leftOut', leftOut);
    showNotice(noticeOf(status, this.audienceLine !== null));
  }

  private leftOut(): string {
    return this.world ? this.stage.leftOut(this.world.bodies.hasSpheres) : '';
  }

  private drawing(): Drawing {
    const sorted = this.drawn.map(({ ms }) => ms).sort((a, b) => a - b);
    const span = this.drawn.length > 1 ? this.drawn[this.drawn.length - 1].at - this.drawn[0].at : 0;
    const framesPerSecond = span > 0 ? (1000 * (this.drawn.length - 1)) / span : 0;
    return { framesPerSecond, msP50: sorted[sorted.length >> 1] ?? 0, leftOut: this.leftOut() };
  }

  private followTaps(canvas: HTMLCanvasElement): void {
    let down: { id: number; x: number; y: number; at: number } | null = null;
    canvas.addEventListener('pointerdown', (event) => {
      down = event.isPrimary && event.button === 0 ? { id: event.pointerId, x: event.clientX, y: event.clientY, at: event.timeStamp } : null;
    });
    canvas.addEventListener('pointerup', (event) => {
      const tapped = down && down.id === event.pointerId && event.timeStamp - down.at < tapMs;
      if (tapped && Math.hypot(event.clientX - down!.x, event.clientY - down!.y) < tapPixels) {
        this.push(event.clientX, event.clientY, event.pointerType === 'touch' ? 14 : 3);
      }
      down = null;
    });
  }

  /** Pushes the body under a place of the page away from the viewer. */
  private push(x: number, y: number, slackPixels: number): void {
    const { uncorrected } = this.client.status();
    const sample = this.sample('extrapolate');
    if (!sample || !this.world) return;
    const { origin, direction, pixel } = this.stage.ray(x, y);
    if (this.audienceLine) return;
    const slot = pick(this.world.slowMotion.seen(sample), this.radii, origin, direction, slackPixels * pixel);
    if (slot >= 0 && uncorrected) {
      toast('Where bodies really are is not what you see: switch corrections on to push them', true);
      return;
    }
    if (slot < 0 || !sample.alive[slot]) return;
    const centre = Array.from(sample.positions.subarray(3 * slot, 3 * slot + 3)) as Vec3;
    const radius = this.radii[sample.types[slot]];
    const limit = this.world.scene.maxPush || Infinity;
    const speed = Math.min(pushRadiiPerS * radius, limit);
    const velocity = direction.map((c) => c * speed) as Vec3;
    ripple(x, y);
    this.send(`push of ${threeDigits(speed)} m/s at body ${slot}`, () => this.client.sendPush(centre, pushReachRadii * radius, velocity));
  }

  private send(what: string, send: () => number): void {
    try {
      this.sent.set(send(), what);
    } catch (error) {
      toast(`${what}: ${error instanceof Error ? error.message : error}`, true);
    }
  }

  private showOutcome({ number, kind, frame, reason, latencyMs }: OutcomeEvent): void {
    const what = this.sent.get(number) ?? 'input';
    this.sent.delete(number);
    if (kind !== 'acted') toast(`${what}: ${kind === 'refused' ? `refused, ${reason}` : 'outcome unknown'}`, true);
    else if (what !== 'gravity' && what !== 'seek') toast(`${what} acted in frame ${frame.toLocaleString('en')}, after ${latencyMs.toFixed(0)} ms`);
  }

  /** Keeps the world in the space that the panels leave free. */
  private panelsChanged(): void {
    const panel = element('panel').getBoundingClientRect();
    const controls = element('controls').getBoundingClientRect();
    const look = element('look').getBoundingClientRect();
    const narrow = matchMedia('(max-width: 720px)').matches;
    const open = element('panel').classList.contains('open');
    if (narrow && open) return;
    if (panel.width === 0) return; // ?bare
    this.stage.setInsets(
      narrow
        ? { top: panel.bottom, right: 0, bottom: innerHeight - controls.top, left: 0 }
        : { top: 0, right: innerWidth - panel.left, bottom: innerHeight - look.top, left: 0 },
    );
  }
}

/** Gets everything ready that a picture needs but bodies; returns what opens the page with them. */
export function drawableOn(surface: Surface): (client: Client, fromFiles: boolean) => Page {
  const stage = new Stage(surface);
  warmUp(stage);
  performance.mark('tandem-drawable');
  return (client, fromFiles) => new Page(client, stage, fromFiles);
}
