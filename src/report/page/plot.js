// One plot over frequency. All of them share the range and the cursor of `state`.

const margin = { left: 68, right: 14, top: 8, bottom: 24 };
const plots = [];

// Pieces of a curve between gaps: [[x, y], …] in pixels. `jump` is the height in pixels above which
// neighbours are not joined.
function pieces(xs, ys, jump) {
  const all = [];
  let piece = [];
  xs.forEach((x, i) => {
    const gap = ys[i] === null || !Number.isFinite(ys[i]);
    if (gap || (piece.length && Math.abs(ys[i] - piece[piece.length - 1][1]) > jump)) {
      if (piece.length) all.push(piece);
      piece = [];
    }
    if (!gap) piece.push([x, ys[i]]);
  });
  if (piece.length) all.push(piece);
  return all;
}

const join = points => points.map(p => p[0].toFixed(1) + ' ' + p[1].toFixed(1)).join('L');
const curvePath = (xs, ys, jump = Infinity) =>
  pieces(xs, ys, jump)
    .map(p => 'M' + join(p))
    .join('');

// A band has the gaps and the jumps of its middle.
function bandPath(xs, lows, highs, jump = Infinity) {
  const indices = xs.map((_, i) => i);
  const middles = indices.map(i => (lows[i] === null || highs[i] === null ? null : (lows[i] + highs[i]) / 2));
  const edge = (piece, ys) => piece.map(([i]) => [xs[i], ys[i]]);
  return pieces(indices, middles, jump)
    .map(p => (p.length < 2 ? '' : `M${join(edge(p, highs))}L${join(edge(p, lows).reverse())}Z`))
    .join('');
}

// Marks by status; the shape says it without colour.
const shapes = {
  good: (x, y, r) => `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`,
  unsettled: (x, y, r) => shapes.good(x, y, r * 1.5),
  low_signal: (x, y, r) => `M${x - 1.7 * r} ${y - 1.2 * r}h${3.4 * r}l${-1.7 * r} ${2.9 * r}Z`,
  clipped: (x, y, r) => `M${x - 1.4 * r} ${y - 1.4 * r}h${2.8 * r}v${2.8 * r}h${-2.8 * r}Z`,
  distorted: (x, y, r) => `M${x} ${y - 2 * r}l${2 * r} ${2 * r}l${-2 * r} ${2 * r}l${-2 * r} ${-2 * r}Z`,
  rt_fault: (x, y, r) =>
    `M${x - 1.6 * r} ${y - 1.6 * r}l${3.2 * r} ${3.2 * r}m0 ${-3.2 * r}l${-3.2 * r} ${3.2 * r}`,
  stopped: (x, y, r) => `M${x - 2 * r} ${y}h${4 * r}m${-2 * r} ${-2 * r}v${4 * r}`,
};
const shape = status => shapes[status] || shapes.unsettled;
const plain = status => status === 'good' || status === 'imported';

function markPaths(xs, ys, statuses, radius) {
  const byStatus = {};
  xs.forEach((x, i) => {
    if (ys[i] === null || !Number.isFinite(ys[i])) return;
    const status = statuses ? statuses[i] : 'good';
    const r = plain(status) ? radius : Math.max(radius, 2.6);
    (byStatus[status] ||= []).push(
      shape(plain(status) ? 'good' : status)(+x.toFixed(1), +ys[i].toFixed(1), r),
    );
  });
  return Object.entries(byStatus)
    .map(
      ([status, marks]) =>
        `<path class="mark ${plain(status) ? '' : 'other'}" data-status="${esc(status)}" d="${marks.join('')}"/>`,
    )
    .join('');
}

class Plot {
  // spec: {id, title, unit(), height, log, layers(), label(v), angle, zero, least()}; a layer is
  // {style, f, y, low, high, line, marks, status, bars}, values in the units chosen.
  constructor(host, spec) {
    this.spec = spec;
    this.panel = document.createElement('section');
    this.panel.className = 'panel';
    this.panel.innerHTML = `<h3></h3><div class="plot" id="${spec.id}" tabindex="0" role="img"></div>`;
    host.append(this.panel);
    this.head = this.panel.querySelector('h3');
    this.box = this.panel.querySelector('.plot');
    plots.push(this);
    attachPointer(this);
  }

  render() {
    const { spec } = this;
    const width = Math.max(240, this.box.clientWidth),
      height = spec.height;
    const [f0, f1] = state.range || fullRange();
    const x = (this.x = logScale(f0, f1, margin.left, width - margin.right));
    const layers = spec.layers();
    const inView = layers.flatMap(l =>
      [l.y, l.low, l.high].filter(Boolean).flatMap(ys => ys.filter((v, i) => l.f[i] >= f0 && l.f[i] <= f1)),
    );
    const log = typeof spec.log === 'function' ? spec.log() : spec.log;
    let [lo, hi] = extent(inView, log);
    if (spec.clamp) [lo, hi] = spec.clamp(lo, hi, layers, f0, f1);
    // What differs by less is the same.
    const least = log || !spec.least ? 0 : spec.least();
    if (hi - lo < least) [lo, hi] = [(lo + hi - least) / 2, (lo + hi + least) / 2];
    const bottom = height - margin.bottom;
    const y = (this.y = (log ? logScale : linearScale)(lo, hi, bottom, margin.top));
    const title = spec.title();
    this.head.innerHTML = `${esc(title)} <span>${esc(spec.unit())}</span>${spec.legend ? spec.legend() : ''}`;
    this.box.setAttribute('aria-label', `${title} over frequency`);
    this.box.innerHTML =
      `<svg height="${height}" viewBox="0 0 ${width} ${height}">` +
      `<defs><clipPath id="clip-${spec.id}"><rect x="${margin.left}" y="${margin.top}" width="${width - margin.left - margin.right}" height="${bottom - margin.top}"/></clipPath></defs>` +
      this.grid(width, height, log) +
      `<g clip-path="url(#clip-${spec.id})">` +
      layers.map(l => this.layer(l, bottom)).join('') +
      '</g>' +
      `<rect class="frame" x="${margin.left + 0.5}" y="${margin.top + 0.5}" width="${width - margin.left - margin.right - 1}" height="${bottom - margin.top - 1}"/>` +
      '<g class="over"></g></svg>';
    this.over = this.box.querySelector('.over');
    this.placeCursor();
  }

  grid(width, height, log) {
    const bottom = height - margin.bottom,
      right = width - margin.right;
    const fx = hz => inFrequency(hz),
      { x, y } = this;
    const room = (right - margin.left) / 46;
    const ticks = logTicks(fx(x.lo), fx(x.hi), room);
    const px = v => x(v / fx(1)).toFixed(1);
    const vertical = list => list.map(v => `M${px(v)} ${margin.top}V${bottom}`).join('');
    let html = `<path class="minor" d="${vertical(ticks.minor)}"/><path class="major" d="${vertical(ticks.major)}"/>`;
    const last = ticks.major.filter(v => +px(v) < right - 18 - 5 * frequencyUnit().length);
    html += last
      .map(v => `<text x="${px(v)}" y="${bottom + 16}" text-anchor="middle">${logLabel(v)}</text>`)
      .join('');
    html += `<text x="${right}" y="${bottom + 16}" text-anchor="end">${frequencyUnit()}</text>`;

    const rows = Math.max(2, Math.floor((bottom - margin.top) / 32));
    let major,
      minor = [],
      label;
    if (log) {
      ({ major, minor } = logTicks(y.lo, y.hi, rows));
      label = logLabel;
    } else if (this.spec.angle) {
      const k = inPhase(turn / 360),
        step = angleStep((y.hi - y.lo) / k, rows) * k;
      major = linearTicks(y.lo, y.hi, step);
      label = state.degrees ? linearLabel(step) : radianLabel;
    } else {
      let step = niceStep(y.hi - y.lo, rows);
      // A single label says nothing of the scale.
      if (linearTicks(y.lo, y.hi, step).length < 3) step = niceStep(y.hi - y.lo, 2 * rows);
      major = linearTicks(y.lo, y.hi, step);
      label = linearLabel(step);
    }
    const horizontal = list => list.map(v => `M${margin.left} ${y(v).toFixed(1)}H${right}`).join('');
    html += `<path class="minor" d="${horizontal(minor)}"/><path class="major" d="${horizontal(major)}"/>`;
    if (this.spec.zero && y.lo < 0 && y.hi > 0) html += `<path class="zero" d="${horizontal([0])}"/>`;
    return (
      html +
      major
        .map(
          v =>
            `<text x="${margin.left - 8}" y="${(y(v) + 4).toFixed(1)}" text-anchor="end">${label(v)}</text>`,
        )
        .join('')
    );
  }

  layer(l, bottom) {
    const xs = l.f.map(this.x),
      to = v => (v === null || !Number.isFinite(v) || (this.y.log && v <= 0) ? null : this.y(v));
    const jump = l.jump ? Math.abs(this.y(l.jump) - this.y(0)) : Infinity;
    let html = '';
    if (l.low)
      html += `<path class="band ${l.neutral ? 'neutral' : ''}" d="${bandPath(xs, l.low.map(to), l.high.map(to), jump)}"/>`;
    if (l.y && l.line) html += `<path class="curve ${l.line}" d="${curvePath(xs, l.y.map(to), jump)}"/>`;
    if (l.y && l.bars)
      html += `<path class="curve" d="${xs.map((x, i) => (to(l.y[i]) === null ? '' : `M${x.toFixed(1)} ${bottom}V${to(l.y[i]).toFixed(1)}`)).join('')}"/>`;
    if (l.y && l.marks) {
      const count = l.f.length,
        radius = count > 260 ? 1.4 : count > 120 ? 1.9 : 2.5;
      html += markPaths(xs, l.y.map(to), l.status, radius);
    }
    if (l.outside)
      html += `<path class="mark outside" d="${xs.map((x, i) => (l.outside[i] && to(l.y[i]) !== null ? shapes.good(+x.toFixed(1), +to(l.y[i]).toFixed(1), 2.8) : '')).join('')}"/>`;
    return `<g style="${l.style || ''}">${html}</g>`;
  }

  placeCursor() {
    if (!this.over) return;
    const height = this.spec.height - margin.bottom;
    if (state.at === null || state.at < this.x.lo || state.at > this.x.hi) {
      this.over.innerHTML = '';
      return;
    }
    const x = this.x(state.at).toFixed(1);
    this.over.innerHTML = `<path class="cursor" d="M${x} ${margin.top}V${height}"/>`;
  }
}
