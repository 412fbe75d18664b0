// The loop that a controller closes: L before and after the notch, and its figures with intervals.

function unwrappedLoop(curve) {
  const abs = curve.re.map((x, i) => Math.hypot(x, curve.im[i]));
  return { abs, arg: unwrapped(curve.re, curve.im) };
}

function loopPlots(host) {
  const { loop } = page;
  const before = unwrappedLoop(loop.before),
    after = loop.after && unwrappedLoop(loop.after);
  const key = (style, text) =>
    `<span><svg width="14" height="14" viewBox="-7 -7 14 14"><path d="M-7 0H7" style="${style}"/></svg>${text}</span>`;
  const legend = () =>
    after
      ? `<span class="legend">${key('stroke:var(--soft);stroke-width:1.6;stroke-dasharray:5 3', 'before')}${key('stroke:var(--s2);stroke-width:1.6', 'with the notch')}</span>`
      : '';
  const layers = (values, jump) => {
    const one = (curve, style, line) => ({ style, f: loop.f, y: values(curve), line, jump });
    const all = [one(before, '--c:var(--soft)', after ? 'dashed' : 'full')];
    return after ? all.concat(one(after, '--c:var(--s2)', 'full')) : all;
  };
  new Plot(host, {
    id: 'loop-gain',
    height: 240,
    legend,
    zero: true,
    log: () => !state.db,
    title: () => 'Loop L = PC, gain',
    unit: () => (state.db ? 'dB, ' : '') + `of the model with ${loop.controller}`,
    layers: () => layers(c => c.abs.map(inGain)),
  });
  new Plot(host, {
    id: 'loop-phase',
    height: 200,
    angle: true,
    title: () => 'Loop L = PC, phase',
    unit: () => (state.degrees ? 'degrees' : 'rad'),
    layers: () =>
      layers(
        c => c.arg.map(v => inPhase(state.wrapped ? wrap(v) : v)),
        state.wrapped ? inPhase(turn / 2) : undefined,
      ),
  });
}

const loopFigures = [
  ['Gain margin, dB', l => l.gain_margin && l.gain_margin.margin_db],
  ['Phase margin, °', l => l.phase_margin && l.phase_margin.margin_deg],
  ['Gain crossover, Hz', l => l.phase_margin && l.phase_margin.frequency_hz],
  ['Delay margin, ms', l => l.delay_margin && l.delay_margin.delay_s, 1e3],
  ['Sensitivity peak Ms', l => l.sensitivity_peak && l.sensitivity_peak.peak],
  ['Bandwidth of T, Hz', l => l.bandwidth_hz],
];

function figureCell(figure, scale) {
  if (!figure || figure.value === null || figure.value === undefined) return '–';
  const k = scale || 1,
    half = (0.5 * k * (figure.high - figure.low)) || NaN;
  return withInterval(k * figure.value, half, 4);
}

function loopTable() {
  const { loop } = page;
  const columns = [
    ['model', loop.model],
    ['points', loop.points],
  ];
  if (loop.notch && loop.notch.after) columns.push(['with notch', loop.notch.after]);
  const rows = loopFigures.map(([name, get, scale]) => [
    name,
    ...columns.map(([, figures]) => figureCell(get(figures), scale)),
  ]);
  rows.push([
    'Closed loop',
    ...columns.map(([, figures]) =>
      figures.stable === null || figures.stable === undefined
        ? '–'
        : figures.stable
          ? '<span class="status-good">stable</span>'
          : '<span class="status-other">unstable</span>',
    ),
  ]);
  return simpleTable(['', ...columns.map(c => c[0])], rows, range(1, columns.length + 1, i => i));
}

function notchTable() {
  const { notch, no_notch } = page.loop;
  if (!notch) return `<p class="note">No notch: ${esc(no_notch)}</p>`;
  const rows = notch.notches.map(n => [
    significant(n.frequency_hz, 6),
    fixed(n.depth_db, 1),
    significant(n.width_hz, 4),
    n.interval_hz.map(v => significant(v, 6)).join(' to '),
    fixed(n.worst_attenuation_db, 1),
    fixed(n.phase_cost_deg, 3) + ' at ' + significant(n.crossover_hz, 4) + ' Hz',
    n.biquad ? `<code>${n.biquad.b.concat(n.biquad.a.slice(1)).join(', ')}</code>` : '–',
  ]);
  return simpleTable(
    ['Hz', 'depth dB', 'width Hz', 'resonance within Hz', 'attenuates at least dB', 'phase cost °', 'b0, b1, b2, a1, a2'],
    rows,
    [0, 1, 2, 4],
  );
}

const marginsPanel = () =>
  `<section class="panel" id="margins"><h3>Margins <span>with ${esc(page.loop.controller)}${page.loop.rate_hz ? ` at ${page.loop.rate_hz} Hz` : ''}, 95 % intervals</span></h3>${loopTable()}</section>`;

const loopSections = () =>
  page.loop
    ? section(
        'Proposed notch',
        page.loop.notch ? 'keeps its attenuation wherever the resonance may lie' : 'none',
        notchTable(),
        true,
      )
    : '';

const driftSections = () =>
  (page.drift || [])
    .map(d =>
      section(
        'Drift of the model, ' + d.name,
        d.changed ? 'changed' : 'same within its intervals',
        simpleTable(
          ['', 'first', 'now', 'change', '± 95 %', 'p', 'verdict'],
          d.figures.map(f => [
            esc(f.name + (f.unit ? ', ' + f.unit : '')),
            significant(f.first, 6),
            significant(f.other, 6),
            significant(f.change, 3),
            significant(f.change95, 2),
            significant(f.p, 2),
            f.changed ? '<span class="status-other">changed</span>' : '',
          ]),
          [1, 2, 3, 4, 5],
        ),
        true,
      ),
    )
    .join('');
