/**
 * Passes on the latest of many values, at most one in `intervalMs`: the first at once, the last one always.
 */
export class Coalesced<T> {
  private waiting: { value: T } | null = null;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(
    private readonly intervalMs: number,
    private readonly pass: (value: T) => void,
  ) {}

  put(value: T): void {
    this.waiting = { value };
    if (this.timer === null) this.flush();
  }

  private flush(): void {
    this.timer = null;
    if (!this.waiting) return;
    const { value } = this.waiting;
    this.waiting = null;
    this.timer = setTimeout(() => this.flush(), this.intervalMs);
    this.pass(value);
  }
}
