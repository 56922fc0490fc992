// Times of the page's frames, as a line and as a report.
const KEPT = 300; // frames

function percentile(values, fraction) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length === 0 ? null : Number(sorted[Math.min(sorted.length - 1, Math.floor(fraction * sorted.length))].toFixed(2));
}

export class Measurements {
  constructor({ loadMs = null } = {}) {
    this.loadMs = loadMs;
    this.firstOverlayMs = null;
    this.count = 0;
    this.frames = [];
  }

  // `ms`: from the image to its result; the result has the times of the stages.
  add(ms, { width, height, people, stats }) {
    ++this.count;
    this.frames.push({ at: performance.now(), ms, width, height, people: people.length, stats });
    if (this.frames.length > KEPT) this.frames.shift();
  }

  framesPerSecond() {
    const recent = this.frames.slice(-60);
    const span = recent.length < 2 ? 0 : recent.at(-1).at - recent[0].at;
    return span === 0 ? 0 : (1000 * (recent.length - 1)) / span;
  }

  line({ people, stats }) {
    const count = people.length === 1 ? '1 person' : `${people.length} people`;
    return `${count} · ${percentile(this.frames.slice(-60).map(({ ms }) => ms), 0.5)} ms a frame, networks and all ${stats.totalMs.toFixed(1)} ms · ${this.framesPerSecond().toFixed(1)} frames a second`;
  }

  report() {
    const of = (pick) => ({ p50: percentile(this.frames.map(pick), 0.5), p90: percentile(this.frames.map(pick), 0.9) });
    const last = this.frames.at(-1);
    return {
      format: 'maquette-web-report',
      formatVersion: 1,
      userAgent: navigator.userAgent,
      cores: navigator.hardwareConcurrency,
      isCrossOriginIsolated: globalThis.crossOriginIsolated,
      frames: this.count,
      image: last && [last.width, last.height],
      network: last && [last.stats.networkWidth, last.stats.networkHeight],
      people: last?.people ?? null,
      loadMs: this.loadMs,
      firstOverlayMs: this.firstOverlayMs,
      framesPerSecond: Number(this.framesPerSecond().toFixed(2)),
      frameMs: of(({ ms }) => ms),
      stagesMs: Object.fromEntries(
        Object.keys(last?.stats ?? {})
          .filter((name) => name.endsWith('Ms'))
          .map((name) => [name.slice(0, -2), of(({ stats }) => stats[name])]),
      ),
    };
  }
}
