// The time that all views of a page show.

export const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 4, 10];
/** How long a run should play, where that can be had [s]. */
const SHORTEST = 1.5;
const LONGEST = 20;

export class Clock {
  time = 0;
  speed: number;
  private speedChosen = false;
  playing = false;
  private before = 0;

  /** `times` of frames, ascending [s]; `changed` is called with each new time or state. */
  constructor(
    private times: number[],
    private readonly changed: () => void,
  ) {
    this.time = times[0] ?? 0;
    this.speed = this.sensibleSpeed();
  }

  get count(): number {
    return this.times.length;
  }

  /** Of the last frame at or before the time. */
  get index(): number {
    let index = 0;
    while (index + 1 < this.times.length && this.times[index + 1] <= this.time + 1e-12) index++;
    return index;
  }

  /** More frames; who was at the end stays there. */
  setTimes(times: number[]): void {
    const atEnd = !this.playing && this.index === this.times.length - 1;
    this.times = times;
    if (!this.speedChosen) this.speed = this.sensibleSpeed();
    if (atEnd) this.goTo(times.length - 1);
    else this.changed();
  }

  chooseSpeed(speed: number): void {
    this.speed = speed;
    this.speedChosen = true;
  }

  goTo(index: number): void {
    this.time = this.times[Math.max(0, Math.min(this.times.length - 1, index))] ?? 0;
    this.changed();
  }

  step(by: number): void {
    this.pause();
    this.goTo(this.index + by);
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  play(): void {
    if (this.index === this.times.length - 1) this.time = this.times[0];
    this.playing = true;
    this.before = performance.now();
    this.changed();
    requestAnimationFrame((now) => this.tick(now));
  }

  pause(): void {
    this.playing = false;
    this.changed();
  }

  private tick(now: number): void {
    if (!this.playing) return;
    const past = Math.max(0, Math.min(0.25, (now - this.before) / 1000));
    this.before = now;
    this.time += past * this.speed;
    const last = this.times[this.times.length - 1];
    const pause = 0.4 * this.speed; // at the last frame, before it starts again
    if (this.time > last + pause) this.time = this.times[0];
    this.changed();
    requestAnimationFrame((next) => this.tick(next));
  }

  private sensibleSpeed(): number {
    const length = (this.times[this.times.length - 1] ?? 0) - (this.times[0] ?? 0);
    if (length >= SHORTEST && length <= LONGEST) return 1;
    if (length > LONGEST)
      return SPEEDS.find((speed) => length / speed <= LONGEST) ?? SPEEDS[SPEEDS.length - 1];
    return [...SPEEDS].reverse().find((speed) => length / speed >= SHORTEST) ?? SPEEDS[0];
  }
}
