// What the reader chose, and the measured values in the units chosen.

const page = JSON.parse(document.getElementById('data').textContent);
const turn = 2 * Math.PI;
const dbPerRelative = 20 / Math.LN10;

const state = {
  hz: true,
  db: true,
  degrees: true,
  wrapped: false,
  shown: page.responses.map(
    (r, i) =>
      i === 0 ||
      page.kind === 'compare' ||
      (page.responses.length <= 3 && page.responses.every(o => o.unit === page.responses[0].unit)),
  ),
  range: null, // [Hz, Hz] when zoomed
  at: null, // Hz, where the cursor is
  pinned: false,
};

const shownResponses = () => page.responses.filter((r, i) => state.shown[i]);
const colour = response => `--c:var(--s${page.responses.indexOf(response) % 6})`;

const frequencyUnit = () => (state.hz ? 'Hz' : 'rad/s');
const gainUnit = () => (state.db ? 'dB' : '');
const phaseUnit = () => (state.degrees ? '°' : 'rad');
const inFrequency = hz => (state.hz ? hz : hz * turn);
const inGain = abs => (state.db ? 20 * Math.log10(abs) : abs);
const inPhase = rad => (state.degrees ? (rad * 360) / turn : rad);

function wrap(rad) {
  return rad - turn * Math.ceil((rad - Math.PI) / turn);
}

// arg along the points with the jumps above half a turn taken out.
function unwrapped(re, im) {
  let previous = null;
  return re.map((x, i) => {
    if (x === null) return null;
    let value = Math.atan2(im[i], x);
    if (previous !== null) value += turn * Math.round((previous - value) / turn);
    previous = value;
    return value;
  });
}

function derive(r) {
  r.abs = r.re.map((x, i) => (x === null ? null : Math.hypot(x, r.im[i])));
  r.arg = unwrapped(r.re, r.im);
}

for (const r of page.responses) {
  derive(r);
  for (const model of r.models) {
    model.abs = model.re.map((x, i) => Math.hypot(x, model.im[i]));
    model.arg = unwrapped(model.re, model.im);
    shiftToMeasured(model, r);
  }
}

// The unwrapped phase of a model may start a turn away from that of the points.
function shiftToMeasured(model, r) {
  const first = r.arg.findIndex(v => v !== null);
  if (first < 0) return;
  const k = nearest(model.f, r.f[first]);
  const turns = turn * Math.round((r.arg[first] - model.arg[k]) / turn);
  model.arg = model.arg.map(v => v + turns);
}

// Index of the entry nearest to hz on a log axis.
function nearest(frequencies, hz) {
  let best = 0,
    distance = Infinity;
  frequencies.forEach((f, i) => {
    const d = Math.abs(Math.log(f / hz));
    if (d < distance) {
      distance = d;
      best = i;
    }
  });
  return best;
}

const gainOf = r => r.abs.map(v => (v === null ? null : inGain(v)));
const phaseOf = r => r.arg.map(v => (v === null ? null : inPhase(state.wrapped ? wrap(v) : v)));
// Half-width of the 95 % interval of the gain at a point, in dB or absolute.
const gainHalf = (r, i) =>
  r.gain95[i] === null ? NaN : state.db ? r.gain95[i] * dbPerRelative : r.abs[i] * r.gain95[i];
const phaseHalf = (r, i) => (r.phase95[i] === null ? NaN : inPhase(r.phase95[i]));
const gainLow = r =>
  r.abs.map((v, i) =>
    v === null || r.gain95[i] === null ? null : inGain(Math.max(v * (1 - r.gain95[i]), v * 1e-9)),
  );
const gainHigh = r =>
  r.abs.map((v, i) => (v === null || r.gain95[i] === null ? null : inGain(v * (1 + r.gain95[i]))));

const fullRange = () => {
  const all = page.range || page.responses.flatMap(r => r.f);
  if (!all.length) return [1, 10];
  const lo = Math.min(...all),
    hi = Math.max(...all);
  return hi / lo < 1.0001 ? [lo / 2, hi * 2] : [lo / (hi / lo) ** 0.015, hi * (hi / lo) ** 0.015];
};
