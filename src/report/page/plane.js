// Plots in the complex plane: Nyquist and poles with zeros. They follow the cursor and the zoom of
// the frequency plots.

const planeMargin = { left: 60, right: 14, top: 10, bottom: 26 };

// The curve of H with the point −1, equal scales, the 95 % region of the point at the cursor.
class Nyquist {
  constructor(host) {
    this.spec = { id: 'nyquist', height: 0 };
    this.panel = document.createElement('section');
    this.panel.className = 'panel';
    this.panel.innerHTML =
      '<h3></h3><div class="plot" id="nyquist" role="img" aria-label="Nyquist plot"></div>';
    host.append(this.panel);
    this.box = this.panel.querySelector('.plot');
    plots.push(this);
    this.box.addEventListener('pointermove', event => {
      if (!state.pinned) this.follow(event);
    });
    this.box.addEventListener('pointerdown', event => {
      state.pinned = false;
      this.follow(event);
      state.pinned = true;
    });
    this.box.addEventListener('pointerleave', () => {
      if (!state.pinned) moveCursor(null);
    });
    this.box.addEventListener('dblclick', () => {
      state.pinned = false;
      zoom(null);
    });
  }

  inRange(r) {
    const [f0, f1] = state.range || fullRange();
    return r.f.map((f, i) => i).filter(i => r.f[i] >= f0 && r.f[i] <= f1 && r.re[i] !== null);
  }

  // As tall as the Bode plot where it stands beside it.
  height(width) {
    const bode = document.getElementById('bode').getBoundingClientRect();
    const beside = bode.right <= this.box.getBoundingClientRect().left;
    return Math.round(beside ? Math.min(bode.height - 40, width * 1.35) : Math.min(480, width * 0.86));
  }

  render() {
    const shown = shownResponses(),
      m = planeMargin;
    const width = Math.max(240, this.box.clientWidth),
      height = this.height(width);
    const keep = shown.map(r => this.inRange(r));
    const res = shown.flatMap((r, k) => keep[k].map(i => r.re[i])),
      ims = shown.flatMap((r, k) => keep[k].map(i => r.im[i]));
    // The origin belongs to it; without a point there is no scale that could be right.
    const withOrigin = values => (state.range || !values.length ? values : values.concat(0));
    let [x0, x1] = extent(withOrigin(res), false),
      [y0, y1] = extent(withOrigin(ims), false);
    const w = width - m.left - m.right,
      h = height - m.top - m.bottom;
    const k = Math.max((x1 - x0) / w, (y1 - y0) / h);
    const cx = (x0 + x1) / 2,
      cy = (y0 + y1) / 2;
    this.x = linearScale(cx - (k * w) / 2, cx + (k * w) / 2, m.left, width - m.right);
    this.y = linearScale(cy - (k * h) / 2, cy + (k * h) / 2, height - m.bottom, m.top);
    const { x, y } = this;
    const step = niceStep(k * w, 5),
      label = linearLabel(step);
    const tx = linearTicks(x.lo, x.hi, step),
      ty = linearTicks(y.lo, y.hi, step);
    const bottom = height - m.bottom,
      right = width - m.right;
    this.panel.querySelector('h3').innerHTML =
      `Nyquist <span>${sharedUnit(shown) === '1' ? '' : 'in ' + esc(sharedUnit(shown)) + ', '}real → imaginary ↑</span>`;
    let html = `<path class="major" d="${tx.map(v => `M${x(v).toFixed(1)} ${m.top}V${bottom}`).join('')}${ty.map(v => `M${m.left} ${y(v).toFixed(1)}H${right}`).join('')}"/>`;
    html += tx
      .map(v => `<text x="${x(v).toFixed(1)}" y="${bottom + 17}" text-anchor="middle">${label(v)}</text>`)
      .join('');
    html += ty
      .map(v => `<text x="${m.left - 7}" y="${(y(v) + 4).toFixed(1)}" text-anchor="end">${label(v)}</text>`)
      .join('');
    let curves = `<path class="zero" d="M${x(0).toFixed(1)} ${m.top}V${bottom}M${m.left} ${y(0).toFixed(1)}H${right}"/>`;
    shown.forEach((r, n) => {
      const xs = keep[n].map(i => x(r.re[i])),
        ys = keep[n].map(i => y(r.im[i]));
      for (const model of r.models) {
        const at = this.inRange(model);
        curves += `<path class="curve model" d="${curvePath(
          at.map(i => x(model.re[i])),
          at.map(i => y(model.im[i])),
        )}"/>`;
      }
      curves +=
        `<g style="${colour(r)}"><path class="curve ${r.models.length ? 'quiet' : ''}" d="${curvePath(xs, ys)}"/>` +
        markPaths(
          xs,
          ys,
          keep[n].map(i => r.status[i]),
          xs.length > 200 ? 1.4 : 2.1,
        ) +
        '</g>';
    });
    const critical =
      shown.some(r => r.unit === '1') && x(-1) > m.left && x(-1) < right
        ? `<path class="cursor" d="M${x(-1) - 5} ${y(0)}h10M${x(-1)} ${y(0) - 5}v10"/><text x="${x(-1)}" y="${y(0) - 9}" text-anchor="middle">−1</text>`
        : '';
    this.box.innerHTML =
      `<svg height="${height}" viewBox="0 0 ${width} ${height}"><defs><clipPath id="clip-nyquist"><rect x="${m.left}" y="${m.top}" width="${w}" height="${h}"/></clipPath></defs>` +
      html +
      `<g clip-path="url(#clip-nyquist)">${curves}${critical}</g>` +
      `<rect class="frame" x="${m.left + 0.5}" y="${m.top + 0.5}" width="${w - 1}" height="${h - 1}"/><g class="over" clip-path="url(#clip-nyquist)"></g></svg>`;
    this.over = this.box.querySelector('.over');
    this.placeCursor();
  }

  // Where |H − H₀|² in the metric of the covariance is 5.99, the 95 % point of χ² with 2 degrees.
  ellipse(r, i) {
    const [a, b, c] = [r.var_re[i], r.cov_re_im[i], r.var_im[i]];
    if (a === null || a <= 0) return '';
    const l11 = Math.sqrt(a),
      l21 = b / l11,
      l22 = Math.sqrt(Math.max(0, c - l21 * l21)),
      k = Math.sqrt(5.991);
    const points = Array.from({ length: 48 }, (_, n) => {
      const u = k * Math.cos((n / 48) * turn),
        v = k * Math.sin((n / 48) * turn);
      return [this.x(r.re[i] + l11 * u), this.y(r.im[i] + l21 * u + l22 * v)];
    });
    return `<path class="drag" d="M${join(points)}Z"/>`;
  }

  placeCursor() {
    if (!this.over) return;
    this.over.innerHTML =
      state.at === null
        ? ''
        : shownResponses()
            .map(r => {
              const i = r.f.length ? nearest(r.f, state.at) : -1;
              return i < 0 || r.re[i] === null
                ? ''
                : this.ellipse(r, i) +
                    `<circle class="spot" cx="${this.x(r.re[i]).toFixed(1)}" cy="${this.y(r.im[i]).toFixed(1)}" r="4"/>`;
            })
            .join('');
  }

  follow(event) {
    const rect = this.box.getBoundingClientRect();
    const px = event.clientX - rect.left,
      py = event.clientY - rect.top;
    let best = null,
      distance = 40;
    for (const r of shownResponses()) {
      for (const i of this.inRange(r)) {
        const d = Math.hypot(this.x(r.re[i]) - px, this.y(r.im[i]) - py);
        if (d < distance) {
          distance = d;
          best = r.f[i];
        }
      }
    }
    if (best !== null) moveCursor(best);
  }
}

// Poles × and zeros ○ of a model. Both axes are linear up to the smallest root and logarithmic beyond.
class PoleZeroMap {
  constructor(host, response, model) {
    this.model = model;
    this.spec = { id: 'poles-' + page.responses.indexOf(response), height: 300 };
    this.panel = document.createElement('section');
    this.panel.className = 'panel';
    this.panel.innerHTML = `<h3>Poles × and zeros ○ <span>of the model of ${esc(response.name)}, rad/s</span></h3><div class="plot" id="${this.spec.id}" role="img" aria-label="Poles and zeros"></div>`;
    host.append(this.panel);
    this.box = this.panel.querySelector('.plot');
    plots.push(this);
  }

  render() {
    const roots = this.model.poles.concat(this.model.zeros),
      m = planeMargin,
      height = this.spec.height;
    const width = Math.max(240, this.box.clientWidth),
      bottom = height - m.bottom,
      right = width - m.right;
    const sizes = roots.map(r => Math.hypot(...r)).filter(v => v > 0);
    const unit = 10 ** Math.floor(Math.log10(sizes.length ? Math.min(...sizes) : 1));
    const bend = v => Math.asinh((v / unit) * 2);
    const far = bend((sizes.length ? Math.max(...sizes) : 1) * 1.6);
    const positive = Math.max(0.15 * far, ...roots.map(r => bend(r[0]) * 1.15));
    const x = v => m.left + ((bend(v) + far) / (far + positive)) * (right - m.left);
    const y = v => bottom - ((bend(v) + far) / (2 * far)) * (bottom - m.top);
    const decades = [];
    for (let v = unit; bend(v) <= far; v *= 10) decades.push(-v, v);
    const inside = v => x(v) < right - 8;
    const skip = decades.length > 12 ? 2 : 1;
    const label = v => minus(v < 0 ? '-' : '') + logLabel(Math.abs(v));
    const labelled = decades.filter(v => Math.round(Math.log10(Math.abs(v) / unit)) % skip === 0);
    this.box.innerHTML =
      `<svg height="${height}" viewBox="0 0 ${width} ${height}"><path class="major" d="${decades
        .filter(inside)
        .map(v => `M${x(v).toFixed(1)} ${m.top}V${bottom}`)
        .join('')}${decades.map(v => `M${m.left} ${y(v).toFixed(1)}H${right}`).join('')}"/>` +
      `<path class="zero" d="M${x(0).toFixed(1)} ${m.top}V${bottom}M${m.left} ${y(0).toFixed(1)}H${right}"/>` +
      labelled
        .filter(inside)
        .map(v => `<text x="${x(v).toFixed(1)}" y="${bottom + 17}" text-anchor="middle">${label(v)}</text>`)
        .join('') +
      labelled
        .map(v => `<text x="${m.left - 7}" y="${(y(v) + 4).toFixed(1)}" text-anchor="end">${label(v)}</text>`)
        .join('') +
      `<g style="--c:var(--s0);stroke-width:1.6"><path class="curve" d="${this.model.poles.map(r => `M${x(r[0]) - 4} ${y(r[1]) - 4}l8 8m0 -8l-8 8`).join('')}"/></g>` +
      `<g style="--c:var(--s1)"><path class="curve" d="${this.model.zeros.map(r => shapes.good(x(r[0]), y(r[1]), 4)).join('')}"/></g>` +
      `<rect class="frame" x="${m.left + 0.5}" y="${m.top + 0.5}" width="${right - m.left - 1}" height="${bottom - m.top - 1}"/></svg>`;
  }

  placeCursor() {}
}
