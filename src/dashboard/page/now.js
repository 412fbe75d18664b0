// The dwell under way: its signals, the Lissajous figure, the estimate so far, how far the guard is.

const now = { status: null };

// Which part of the sweep this is.
const kinds = {
  waiting: 'waiting for the first tick',
  preflight: 'pre-flight dwell',
  probe: 'probe',
  refined: 'refined dwell',
  remeasured: 'measured again',
  closing: 'back to neutral',
};

const tonesText = hz => hz.map(f => significant(inFrequency(f), 5)).join(', ') + ' ' + frequencyUnit();

function placeText(s) {
  if (s.kind === 'planned') return `<b>${Math.min(s.dwell + 1, page.dwells)}</b> of ${page.dwells} dwells`;
  const added =
    s.kind === 'refined'
      ? ` <b>${s.dwell + 1 - page.dwells}</b> beside the ${page.dwells} of the plan`
      : s.kind === 'remeasured'
        ? `: dwell <b>${s.dwell + 1}</b>`
        : '';
  return kinds[s.kind] + added;
}

// How the point before came about: a transient that was modelled has not been waited for.
function lastText() {
  const last = live.last;
  if (!last) return '';
  const way = { model: ', transient modelled', detection: ', transient seen to go', wait: ', waited for' };
  return `<p class="plain" id="last">before: ${significant(inFrequency(last.f), 5)} ${frequencyUnit()} ${esc(last.status.replace(/_/g, ' '))}${way[last.settled] || ''}</p>`;
}

const nowMargin = { left: 14, right: 14, top: 12, bottom: 22 };

function seconds(s) {
  if (s < 1e-3) return significant(s * 1e6, 3) + ' µs';
  return s < 1 ? significant(s * 1e3, 3) + ' ms' : significant(s, 3) + ' s';
}

function buildNow() {
  document.getElementById('now').innerHTML =
    '<section class="panel signal"><h3>Signals <span id="signal-note"></span></h3><div class="plot" id="signal" role="img" aria-label="Signals of this dwell"></div></section>' +
    '<section class="panel lissajous"><h3>Lissajous <span id="lissajous-note"></span></h3><div class="plot" id="lissajous" role="img" aria-label="Lissajous figure of this dwell"></div></section>' +
    '<section class="panel state"><h3>This dwell <span id="dwell-note"></span></h3><div id="estimate"></div><h3>Guard <span>part of the limits used in this dwell</span></h3><div id="guard"></div><h3>Loop</h3><div id="loop"></div></section>';
}

const span = values => {
  let lo = Infinity,
    hi = -Infinity;
  for (const v of values)
    if (v !== null) {
      lo = Math.min(lo, v);
      hi = Math.max(hi, v);
    }
  if (lo > hi) return [-1, 1];
  return hi > lo ? [lo, hi] : [lo - 1e-12 - Math.abs(lo) * 1e-3, hi + 1e-12 + Math.abs(hi) * 1e-3];
};

// One lane for what was applied (the command behind it), one for each sensor, each in its own scale.
function drawSignal() {
  const box = document.getElementById('signal'),
    { trace, hz } = now.status;
  const width = Math.max(240, box.clientWidth),
    height = 252;
  const lanes = trace.channels.map((values, i) => ({ values, i })).slice(1);
  const count = Math.max(...trace.channels.map(c => c.length), 2);
  const x = i => nowMargin.left + (i / (count - 1)) * (width - nowMargin.left - nowMargin.right);
  const gap = 12,
    lane = (height - nowMargin.top - nowMargin.bottom - gap * (lanes.length - 1)) / lanes.length;
  let html = '';
  lanes.forEach(({ values, i }, n) => {
    const top = nowMargin.top + n * (lane + gap),
      shared = i === 1 ? values.concat(trace.channels[0]) : values;
    const [lo, hi] = span(shared),
      y = linearScale(lo, hi, top + lane - 2, top + 14);
    const channel = page.channels[i];
    html += `<path class="minor" d="M${nowMargin.left} ${top + lane}H${width - nowMargin.right}"/>`;
    if (i === 1)
      html += `<path class="curve quiet command" d="${curvePath(trace.channels[0].map((v, k) => x(k)), trace.channels[0].map(v => (v === null ? null : y(v))))}"/>`;
    const style = i === 1 ? '--c:var(--soft)' : `--c:var(--s${(i - 2) % 6})`;
    html += `<g style="${style}"><path class="curve" d="${curvePath(values.map((v, k) => x(k)), values.map(v => (v === null ? null : y(v))))}"/></g>`;
    html += `<text x="${nowMargin.left}" y="${top + 9}"><tspan class="strong">${esc(channel.name)}</tspan> ${values.length ? `${significant(lo, 4)} to ${significant(hi, 4)} ${esc(channel.unit)}` : ''}</text>`;
  });
  const length = trace.step_s * (count - 1);
  html += `<text x="${width - nowMargin.right}" y="${height - 6}" text-anchor="end">now</text><text x="${nowMargin.left}" y="${height - 6}">−${seconds(length)}</text>`;
  box.innerHTML = `<svg height="${height}" viewBox="0 0 ${width} ${height}">${html}</svg>`;
  document.getElementById('signal-note').textContent = hz
    ? `${fixed(length * Math.min(...hz), 1)} cycles${hz.length > 1 ? ' of the slowest tone' : ''}`
    : '';
}

// Output over input of the first response shown. A line is a gain without lag, a circle a quarter turn.
function drawLissajous() {
  const box = document.getElementById('lissajous'),
    { trace } = now.status;
  const index = state.shown.findIndex(Boolean),
    [input, output] = page.pairs[Math.max(0, index)];
  const xs = trace.channels[input],
    ys = trace.channels[output];
  const width = Math.max(200, box.clientWidth),
    height = 252;
  const size = Math.min(width - 60, height - 44),
    left = (width - size) / 2 + 10,
    top = 10;
  const [x0, x1] = span(xs),
    [y0, y1] = span(ys);
  const x = linearScale(x0, x1, left + 6, left + size - 6),
    y = linearScale(y0, y1, top + size - 6, top + 6);
  // A sample that either lacks is a gap, not a point on an axis.
  const both = xs.map((v, i) => i < ys.length && v !== null && ys[i] !== null),
    last = both.lastIndexOf(true);
  const style = `--c:var(--s${Math.max(0, index) % 6})`;
  box.innerHTML =
    `<svg height="${height}" viewBox="0 0 ${width} ${height}"><rect class="frame" x="${left + 0.5}" y="${top + 0.5}" width="${size - 1}" height="${size - 1}"/>` +
    `<path class="minor" d="M${left} ${top + size / 2}h${size}M${left + size / 2} ${top}v${size}"/>` +
    (last > 0
      ? `<g style="${style}"><path class="curve" d="${curvePath(xs.map(x), xs.map((v, i) => (both[i] ? y(ys[i]) : null)))}"/><circle class="head" cx="${x(xs[last]).toFixed(1)}" cy="${y(ys[last]).toFixed(1)}" r="4"/></g>`
      : '') +
    `<text x="${left + size / 2}" y="${top + size + 16}" text-anchor="middle">${esc(page.channels[input].name)}</text>` +
    `<text transform="translate(${left - 8} ${top + size / 2}) rotate(-90)" text-anchor="middle">${esc(page.channels[output].name)}</text></svg>`;
  document.getElementById('lissajous-note').textContent =
    `${page.channels[output].name} over ${page.channels[input].name}`;
}

// One response at one tone; the frequency stands with it where there are several.
function estimateRow(estimate, r, tone) {
  const name =
    `<b style="${colour(r)}">${esc(r.name)}</b>` +
    (tone === null ? '' : ` <i>${significant(inFrequency(tone), 4)} ${frequencyUnit()}</i>`);
  if (!estimate) return `<tr><td>${name}</td><td class="n plain" colspan="2">no block yet</td></tr>`;
  const abs = Math.hypot(estimate.re, estimate.im),
    arg = Math.atan2(estimate.im, estimate.re);
  const half = estimate.gain95_db === null ? NaN : estimate.gain95_db;
  const gain = state.db
    ? withInterval(inGain(abs), half, 3) + ' <i>dB</i>'
    : significant(abs, 5);
  const phase =
    withInterval(
      inPhase(arg),
      estimate.phase95_deg === null ? NaN : inPhase((estimate.phase95_deg * turn) / 360),
      state.degrees ? 2 : 4,
    ) + (state.degrees ? '<i>°</i>' : ' <i>rad</i>');
  return `<tr><td>${name}</td><td class="n">${gain}</td><td class="n">${phase}</td></tr>`;
}

// Where a part of the limits would tell nothing (there is one only, or what lasts too short does not
// count) it is the distance that is left.
function guardRow(row) {
  const used = row.used === null ? null : Math.max(0, row.used);
  const room = row.lasting_s > 0 ? `${significant(Math.max(row.high, -row.low), 3)}` : `${significant(row.left, 3)} left`;
  const level = used === null ? '' : used > 0.9 ? 'bad' : used > 0.7 ? 'warn' : 'good';
  const limits =
    row.min !== null && row.max !== null
      ? row.min === -row.max
        ? `± ${significant(row.max, 3)}`
        : `${significant(row.min, 3)} … ${significant(row.max, 3)}`
      : row.max !== null
        ? `≤ ${significant(row.max, 3)}`
        : `≥ ${significant(row.min, 3)}`;
  return (
    `<tr><td>${esc(row.name)}</td><td class="meter"><span class="${level}" style="width:${used === null ? 0 : Math.min(100, 100 * used).toFixed(1)}%"></span></td>` +
    `<td class="n">${used !== null ? Math.round(100 * used) + ' %' : row.left === null ? '–' : room}</td>` +
    `<td class="plain">${limits} ${esc(row.unit)}${row.lasting_s > 0 ? ' for ' + seconds(row.lasting_s) : ''}</td></tr>`
  );
}

function drawState() {
  const s = now.status;
  const first = s.estimates.length ? s.estimates[0][0] : null;
  const several = s.hz && s.hz.length > 1;
  document.getElementById('dwell-note').textContent = [
    s.kind === 'planned' ? '' : kinds[s.kind],
    s.hz ? tonesText(s.hz) : '',
    s.amplitude ? `amplitude ${significant(s.amplitude, 3)} ${page.channels[0].unit}` : '',
    s.retries ? `try ${s.retries + 1}` : '',
  ]
    .filter(Boolean)
    .join(', ');
  document.getElementById('estimate').innerHTML =
    (s.hz
      ? `<table>${page.responses.map((r, i) => s.hz.map((hz, tone) => estimateRow(s.estimates[i][tone], r, several ? hz : null)).join('')).join('')}</table>` +
        `<p class="plain">${s.waiting ? 'waiting for the transient' : first ? `from the last ${count(first.blocks, 'block', 'blocks')}` : 'measuring'}, ${seconds(s.dwell_s)} of at most ${seconds(s.dwell_most_s)}</p>`
      : s.kind === 'probe'
        ? `<p class="plain">a chirp from ${significant(inFrequency(page.probe[0]), 3)} to ${significant(inFrequency(page.probe[1]), 3)} ${frequencyUnit()} that shows the modes of the rig</p>`
        : '') + lastText();
  document.getElementById('guard').innerHTML = s.headroom.length
    ? `<table>${s.headroom.map(guardRow).join('')}</table>`
    : '<p class="plain">no limits of values in this rig file; ages, codes and lateness are watched without a meter</p>';
  document.getElementById('loop').innerHTML = page.real_time
    ? `<p><b id="late">${significant(s.late_us, 3)} µs</b> late, at most <b>${significant(s.late_max_us, 3)} µs</b> <span class="plain">of ${significant(1e6 / page.runs[0].rate_hz, 4)} µs</span>, <b>${s.skipped}</b> skipped</p>`
    : `<p>virtual clock: as fast as the machine goes, <b>${s.skipped}</b> skipped</p>`;
}

function drawNow() {
  if (!now.status) return;
  drawSignal();
  drawLissajous();
  drawState();
}
