// Which plots there are: gain, phase, residuals or differences, and the small ones.

const range = (lo, hi, f) => Array.from({ length: hi - lo }, (_, i) => f(lo + i));

// Of an axis of gain in dB and of phase in degrees, as in the pictures: far above rounding and a
// hundredth of what any bench resolves.
const leastSpan = 1e-3;

function measured(values, band) {
  return shownResponses().flatMap(r => {
    const y = values(r);
    const layers = [];
    if (band)
      layers.push({ style: colour(r), f: r.f, low: band.low(r), high: band.high(r), jump: band.jump });
    layers.push({
      style: colour(r),
      f: r.f,
      y,
      line: band && r.models.length ? 'quiet' : 'full',
      marks: true,
      status: r.status,
      jump: band && band.jump,
    });
    return layers;
  });
}

const modelled = (values, low, high) =>
  shownResponses().flatMap(r =>
    r.models.flatMap(m => [
      ...(m.gain95.length ? [{ f: m.f, low: low(m), high: high(m), neutral: true }] : []),
      { f: m.f, y: values(m), line: 'model', jump: 0 },
    ]),
  );

function statusLegend() {
  const present = [...new Set(shownResponses().flatMap(r => r.status))].filter(s => !plain(s));
  const models = shownResponses().some(r => r.models.length);
  const item = (svg, text) =>
    `<span><svg width="14" height="14" viewBox="-7 -7 14 14">${svg}</svg>${esc(text)}</span>`;
  const items = present.map(s =>
    item(
      `<path d="${shape(s)(0, 0, 2.6)}" style="fill:var(--panel);stroke:var(--warn);stroke-width:1.6"/>`,
      s.replace(/_/g, ' '),
    ),
  );
  if (models) items.unshift(item('<path d="M-7 0H7" style="stroke:var(--ink);stroke-width:1.6"/>', 'model'));
  return items.length ? `<span class="legend">${items.join('')}</span>` : '';
}

function gainPlot() {
  return {
    id: 'gain',
    height: 300,
    least: () => leastSpan,
    legend: statusLegend,
    title: () => 'Gain',
    log: () => !state.db,
    unit: () => (state.db ? 'dB re ' : 'times ') + sharedUnit(shownResponses()) + ', shaded: 95 % interval',
    layers: () => modelled(gainOf, gainLow, gainHigh).concat(measured(gainOf, { low: gainLow, high: gainHigh })),
    // A point drowned in noise may have an interval that reaches to nothing: it does not set the axis.
    clamp: (lo, hi, layers, f0, f1) => {
      const values = layers.filter(l => l.y).flatMap(l => l.y.filter((v, i) => l.f[i] >= f0 && l.f[i] <= f1));
      const [a, b] = extent(values, !state.db);
      return state.db
        ? [Math.max(lo, a - 0.35 * (b - a)), Math.min(hi, b + 0.35 * (b - a))]
        : [Math.max(lo, a / (b / a) ** 0.35), Math.min(hi, b * (b / a) ** 0.35)];
    },
  };
}

function phasePlot() {
  const half = r => r.f.map((f, i) => Math.min(phaseHalf(r, i), inPhase(turn / 2)));
  const shift = sign => r => {
    const p = phaseOf(r),
      h = half(r);
    return p.map((v, i) => (v === null || !Number.isFinite(h[i]) ? null : v + sign * h[i]));
  };
  return {
    id: 'phase',
    height: 240,
    angle: true,
    least: () => inPhase((leastSpan * turn) / 360),
    title: () => 'Phase',
    unit: () =>
      (state.degrees ? 'degrees' : 'rad') + (state.wrapped ? ', within half a turn' : ', continuous'),
    layers: () => {
      const jump = state.wrapped ? inPhase(turn / 2) : undefined;
      return modelled(phaseOf, shift(-1), shift(1))
        .map(l => ({ ...l, jump }))
        .concat(measured(phaseOf, { low: shift(-1), high: shift(1), jump }));
    },
    clamp: state.wrapped ? null : undefined,
  };
}

// Choe's method: the models of the sub-bands beside their mean, and the weight made of their spread.
const spread = pick =>
  shownResponses()
    .filter(r => r.choe)
    .flatMap(r =>
      r.choe.bands.map((b, k) => ({
        style: `--c:var(--s${k % 6})`,
        f: r.choe.f,
        y: pick(b),
        line: 'full',
      })),
    );

function choePlots(host) {
  const choe = (id, title, unit, layers) =>
    new Plot(host, { id, height: 240, log: true, title: () => title, unit, layers });
  const unit = () => 'in ' + sharedUnit(shownResponses().filter(r => r.choe));
  choe(
    'choe-models',
    'Models of the sub-bands',
    () => unit() + '; black: nominal, their mean; points: measured',
    () =>
      spread(b => b.gain).concat(
        shownResponses()
          .filter(r => r.choe)
          .flatMap(r => [
            { f: r.choe.f, y: r.choe.nominal, line: 'model' },
            { style: colour(r), f: r.f, y: r.abs, marks: true, status: r.status },
          ]),
      ),
  );
  choe(
    'choe-weight',
    'Additive uncertainty and weight',
    () => unit() + '; lines: |model − nominal| of each sub-band; black: weight |Wₐ|, their largest',
    () =>
      spread(b => b.additive).concat(
        shownResponses()
          .filter(r => r.choe)
          .map(r => ({ f: r.choe.f, y: r.choe.weight, line: 'model' })),
      ),
  );
}

// Residuals and differences: points against their interval around zero.
function againstZero(id, title, unit, sets) {
  return {
    id,
    height: 170,
    zero: true,
    title: () => title,
    unit: () => unit() + ', shaded: 95 % interval',
    layers: () =>
      sets().flatMap(s => {
        const half = s.half.map(v => (Number.isFinite(v) ? v : null));
        return [
          { style: s.style, f: s.f, low: half.map(v => (v === null ? null : -v)), high: half },
          {
            style: s.style,
            f: s.f,
            y: s.y,
            marks: true,
            line: 'quiet',
            outside: s.outside || s.y.map((v, i) => half[i] !== null && Math.abs(v) > half[i]),
          },
        ];
      }),
  };
}

function residuals(gain) {
  return shownResponses().flatMap(r =>
    r.models
      .slice(0, 1)
      .map(m => ({
        style: colour(r),
        f: r.f,
        y: r.f.map((f, i) =>
          r.re[i] === null
            ? null
            : gain
              ? 20 * Math.log10(r.abs[i] / Math.hypot(m.at_re[i], m.at_im[i]))
              : inPhase(wrap(r.arg[i] - Math.atan2(m.at_im[i], m.at_re[i]))),
        ),
        half: r.f.map((f, i) =>
          r.gain95[i] === null ? NaN : gain ? r.gain95[i] * dbPerRelative : phaseHalf(r, i),
        ),
      })),
  );
}

const differences = gain =>
  page.differences.map(d => ({
    style: colour(page.responses.find(r => r.name === d.name)),
    f: d.f,
    outside: d.changed,
    y: gain ? d.gain_db : d.phase_deg.map(v => inPhase((v * turn) / 360)),
    half: gain
      ? d.gain95_db.map(v => v ?? NaN)
      : d.phase95_deg.map(v => (v === null ? NaN : inPhase((v * turn) / 360))),
  }));

const has = key => page.responses.some(r => r[key].some(v => v !== null && v > 0));

function smallPlots(host) {
  const simple = (id, title, unit, values, log, clamp) =>
    new Plot(host, { id, height: 200, log, title: () => title, unit, layers: () => measured(values), clamp });
  if (page.responses.some(r => r.gain95.some(v => v > 0))) {
    simple(
      'gain95',
      'Half-width of the 95 % interval of the gain',
      () => (state.db ? 'dB' : 'relative'),
      r => r.gain95.map(v => (v === null ? null : state.db ? v * dbPerRelative : v)),
      true,
    );
    simple(
      'phase95',
      'Half-width of the 95 % interval of the phase',
      () => (state.degrees ? 'degrees' : 'rad'),
      r => r.phase95.map(v => (v === null ? null : inPhase(v))),
      true,
    );
  }
  if (has('snr'))
    simple(
      'snr',
      'Signal to noise',
      () => 'dB, tone over residual, per sample',
      r => r.snr,
      false,
    );
  if (has('coherence'))
    simple(
      'coherence',
      'Coherence',
      () => 'γ², over records of one cycle',
      r => r.coherence,
      false,
      lo => [Math.min(lo, 0.9), 1 + 0.03 * (1 - Math.min(lo, 0.9))],
    );
  if (has('distortion'))
    simple(
      'distortion',
      'Distortion',
      () => '%, harmonics relative to the tone',
      r => r.distortion.map(v => (v === null ? null : 100 * v)),
      true,
    );
  if (has('amplitude'))
    simple(
      'amplitude',
      'Amplitude of ' + [...new Set(shownResponses().map(r => r.input))].join(' and '),
      () => [...new Set(shownResponses().map(r => r.input_unit))].join(' and '),
      r => r.amplitude,
      true,
    );
  if (has('response'))
    simple(
      'response',
      'Amplitude of the response',
      () => [...new Set(shownResponses().map(r => r.output_unit))].join(' and '),
      r => r.response,
      true,
    );
  const names = [...new Set(page.responses.flatMap(r => Object.keys(r.extra)))];
  for (const name of names) {
    simple(
      'extra-' + name,
      name.replace(/_/g, ' '),
      () => '',
      r => r.extra[name] || r.f.map(() => null),
      false,
    );
  }
  const timed = page.runs.filter(run => run.timing.f.length);
  if (timed.some(run => run.timing.late_us.some(v => v > 0))) {
    new Plot(host, {
      id: 'lateness',
      height: 200,
      log: true,
      title: () => 'Latest tick of each dwell',
      unit: () => 'µs after its time',
      layers: () =>
        timed.map((run, n) => ({
          style: `--c:var(--s${n % 6})`,
          f: run.timing.f,
          y: run.timing.late_us,
          bars: true,
        })),
    });
    new Histogram(host, timed);
  }
  // Of the loop's thread: both ought to be none.
  for (const [id, title] of [
    ['faults', 'Page faults of the loop in each dwell'],
    ['switches', 'Involuntary switches of the loop in each dwell'],
  ]) {
    if (!timed.some(run => run.timing[id].some(v => v > 0))) continue;
    new Plot(host, {
      id,
      height: 200,
      log: true,
      title: () => title,
      unit: () => '',
      layers: () =>
        timed.map((run, n) => ({
          style: `--c:var(--s${n % 6})`,
          f: run.timing.f,
          y: run.timing[id],
          bars: true,
        })),
    });
  }
}
