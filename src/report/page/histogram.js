// How late the ticks of the whole run were.
class Histogram {
  constructor(host, runs) {
    this.runs = runs;
    this.panel = document.createElement('section');
    this.panel.className = 'panel';
    this.panel.innerHTML =
      '<h3>Lateness of the loop <span>ticks per class, µs</span></h3><div class="plot" id="histogram" style="cursor:default" role="img" aria-label="Histogram of lateness"></div>';
    host.append(this.panel);
    this.box = this.panel.querySelector('.plot');
    plots.push(this);
  }
  render() {
    const counts = this.runs
      .map(run => run.timing.histogram)
      .reduce((a, b) => range(0, Math.max(a.length, b.length), i => (a[i] || 0) + (b[i] || 0)));
    const last = counts.length - [...counts].reverse().findIndex(c => c > 0);
    const width = Math.max(240, this.box.clientWidth),
      height = 200,
      bottom = height - margin.bottom;
    const top = Math.max(10, ...counts),
      y = logScale(0.7, top * 1.5, bottom, margin.top);
    const slot = (width - margin.left - margin.right) / last;
    const ticks = logTicks(0.7, top * 1.5, 4);
    const name = k => (k === 0 ? '<1' : String(2 ** (k - 1)));
    const every = Math.ceil(34 / slot);
    this.box.innerHTML =
      `<svg height="${height}" viewBox="0 0 ${width} ${height}"><path class="major" d="${ticks.major.map(v => `M${margin.left} ${y(v).toFixed(1)}H${width - margin.right}`).join('')}"/>` +
      ticks.major
        .map(
          v =>
            `<text x="${margin.left - 8}" y="${(y(v) + 4).toFixed(1)}" text-anchor="end">${logLabel(v)}</text>`,
        )
        .join('') +
      range(0, last, k =>
        counts[k]
          ? `<rect class="bar" style="--c:var(--s0)" x="${(margin.left + k * slot + 1.5).toFixed(1)}" y="${y(counts[k]).toFixed(1)}" width="${(slot - 3).toFixed(1)}" height="${(bottom - y(counts[k])).toFixed(1)}"><title>${counts[k]} ticks</title></rect>`
          : '',
      ).join('') +
      range(0, last, k =>
        k % every
          ? ''
          : `<text x="${(margin.left + k * slot + (k === 0 ? slot / 2 : 0)).toFixed(1)}" y="${bottom + 16}" text-anchor="middle">${esc(name(k))}</text>`,
      ).join('') +
      `<path class="zero" d="M${margin.left} ${bottom}H${width - margin.right}"/></svg>`;
  }
  placeCursor() {}
}

