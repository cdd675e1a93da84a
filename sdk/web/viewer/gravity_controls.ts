// The dial, the slider of gravity's strength and the switch that lets the device's tilt set its direction.

import { Coalesced } from './coalesced';
import { downOfDevice, GravityDial, type ViewAxes } from './gravity';
import { element, threeDigits } from './elements';
import { add } from './room';
import { emptyScene, type Scene, type Vec3 } from './scene';

/** Minimum time between two gravities sent. */
const sendEveryMs = 100;
/** From sending gravity until it is surely in force. */
const onItsWayMs = 500;
/** Smaller turns of the device are the hand's trembling; radians. */
const leastTilt = 0.02;

export class GravityControls {
  private readonly dial: GravityDial;
  private readonly strength = element<HTMLInputElement>('strength');
  private readonly sent: Coalesced<Vec3>;
  private tilting = false;
  private wantedMs = -Infinity;

  constructor(
    private readonly axes: () => ViewAxes,
    send: (gravity: Vec3) => void,
  ) {
    this.sent = new Coalesced(sendEveryMs, send);
    this.dial = new GravityDial(element<HTMLCanvasElement>('dial'), axes, (gravity) => {
      this.wantedMs = performance.now();
      this.showValue(gravity);
      this.sent.put(gravity);
    });
    this.strength.addEventListener('input', () => this.dial.setStrength(Number(this.strength.value)));
    this.setScene(emptyScene);
    this.offerTilt();
  }

  setScene(scene: Scene): void {
    const strength = Math.hypot(...scene.gravity) || emptyScene.maxGravity / 10;
    const top = Math.min(3 * strength, scene.maxGravity);
    this.strength.max = String(top);
    this.strength.step = String(top / 60);
    this.show(scene.gravity);
  }

  /** Shows the gravity in force, which others set too; not while one's own is on its way. */
  show(gravity: Vec3): void {
    if (performance.now() < this.wantedMs + onItsWayMs) return;
    this.dial.show(gravity);
    this.showValue(this.dial.value());
  }

  setAllowed(allowed: boolean): void {
    element('gravity').classList.toggle('off', !allowed);
  }

  draw(): void {
    this.dial.draw();
  }

  private showValue(gravity: Vec3): void {
    const strength = Math.hypot(...gravity);
    element('gravityValue').textContent = threeDigits(strength);
    element('dial').title = `gravity ${gravity.map((x) => x.toFixed(2)).join(', ')} m/s²`;
    if (document.activeElement !== this.strength) this.strength.value = String(strength);
  }

  /** Browsers give the device's tilt only to pages that came over TLS, and some ask the user first. */
  private offerTilt(): void {
    const button = element('tilt');
    if (!window.isSecureContext || !('DeviceOrientationEvent' in window) || !matchMedia('(pointer: coarse)').matches) return;
    button.hidden = false;
    let last: Vec3 = [0, 0, 0];
    const follow = (event: DeviceOrientationEvent) => {
      if (event.beta === null || event.gamma === null) return;
      const down = downOfDevice(event.beta, event.gamma, screen.orientation?.angle ?? 0);
      if (Math.hypot(...add(down, last, -1)) < leastTilt) return;
      last = down;
      const strength = Math.hypot(...this.dial.value());
      const gravity = this.axes().reduce<Vec3>((sum, axis, i) => add(sum, axis, down[i] * strength), [0, 0, 0]);
      this.dial.want(gravity);
    };
    button.addEventListener('click', async () => {
      const { requestPermission } = DeviceOrientationEvent as unknown as { requestPermission?: () => Promise<string> };
      if (!this.tilting && requestPermission && (await requestPermission()) !== 'granted') return;
      this.tilting = !this.tilting;
      button.setAttribute('aria-pressed', String(this.tilting));
      if (this.tilting) window.addEventListener('deviceorientation', follow);
      else window.removeEventListener('deviceorientation', follow);
    });
  }
}
