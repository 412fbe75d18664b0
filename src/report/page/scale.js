// Axes: from values to pixels, and ticks that fall on round numbers.

const logScale = (lo, hi, from, to) => {
  const a = Math.log(lo),
    k = (to - from) / (Math.log(hi) - a);
  const scale = v => (v > 0 ? from + (Math.log(v) - a) * k : from - Math.sign(k) * 1e5);
  return Object.assign(scale, { invert: p => Math.exp(a + (p - from) / k), lo, hi, log: true });
};

const linearScale = (lo, hi, from, to) => {
  const k = (to - from) / (hi - lo);
  return Object.assign(v => from + (v - lo) * k, { invert: p => lo + (p - from) / k, lo, hi, log: false });
};

// The smallest step of 1, 2, 5 · 10ⁿ that gives at most `count` intervals.
function niceStep(span, count) {
  const raw = span / count,
    base = 10 ** Math.floor(Math.log10(raw));
  return base * [1, 2, 5, 10].find(m => m * base >= raw * (1 - 1e-9));
}

const angleSteps = [1, 2, 5, 10, 15, 30, 45, 90, 180, 360, 720, 1440, 3600];

function angleStep(spanDeg, count) {
  return spanDeg / count < 1
    ? niceStep(spanDeg, count)
    : angleSteps.find(step => spanDeg / step <= count) || niceStep(spanDeg, count);
}

const mostTicks = 1000; // far above what any plot has room for

function linearTicks(lo, hi, step) {
  const ticks = [],
    first = Math.ceil(lo / step - 1e-9);
  for (let i = 0; i < mostTicks; ++i) {
    const value = (first + i) * step;
    if (!(value <= hi + step * 1e-9)) break;
    // Where the step is below the rounding of the values the next tick is this one again.
    if (ticks.length && !(value > ticks.at(-1))) break;
    ticks.push(value);
  }
  return ticks;
}

// {major: labelled values, minor: other grid lines}. Whole decades when many, 1-2-5 when there is
// room for it, equal steps inside one decade.
function logTicks(lo, hi, room) {
  const from = Math.floor(Math.log10(lo) + 1e-9),
    to = Math.ceil(Math.log10(hi) - 1e-9);
  const decades = Math.log10(hi / lo);
  const inside = v => v >= lo * (1 - 1e-9) && v <= hi * (1 + 1e-9);
  if (decades < 0.75) {
    const step = niceStep(hi - lo, Math.max(2, Math.min(8, room)));
    return { major: linearTicks(lo, hi, step), minor: linearTicks(lo, hi, step / 5) };
  }
  const digits = room / decades >= 3 ? [1, 2, 5] : [1];
  const every = Math.max(1, Math.ceil(decades / room));
  const major = [],
    minor = [];
  for (let n = from; n <= to; ++n) {
    for (let m = 1; m < 10; ++m) {
      const value = m * 10 ** n;
      if (!inside(value)) continue;
      const labelled = digits.includes(m) && n % every === 0;
      if (labelled) major.push(value);
      else if (m === 1 || room / decades >= 1.4) minor.push(value);
    }
  }
  return { major, minor };
}

function logLabel(value) {
  const exponent = Math.floor(Math.log10(value) + 1e-9);
  const digits = String(+(value / 10 ** exponent).toPrecision(6)).replace('.', '').length;
  return power(value, Math.max(1, digits));
}

const linearLabel = step => {
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const large = places > 4;
  return v =>
    large ? (v === 0 ? '0' : significant(v, 2)) : fixed(Math.abs(v) < step * 1e-6 ? 0 : v, places);
};

// Multiples of π where they are short, plain numbers elsewhere.
function radianLabel(v) {
  for (const d of [1, 2, 3, 4, 6, 12]) {
    const n = Math.round((v / Math.PI) * d);
    if (Math.abs((v / Math.PI) * d - n) > 1e-6) continue;
    if (n === 0) return '0';
    return minus(`${Math.abs(n) === 1 ? (n < 0 ? '-' : '') : n}π${d === 1 ? '' : '/' + d}`);
  }
  return fixed(v, 3);
}

// The range of the values with a margin; for a log axis only what is above zero counts.
function extent(values, log) {
  let lo = Infinity,
    hi = -Infinity;
  for (const v of values) {
    if (v === null || !Number.isFinite(v) || (log && v <= 0)) continue;
    if (v < lo) lo = v;
    if (v > hi) hi = v;
  }
  if (lo > hi) return log ? [1, 10] : [-1, 1];
  if (log) return hi / lo < 1.5 ? [lo / 1.6, hi * 1.6] : [lo / (hi / lo) ** 0.06, hi * (hi / lo) ** 0.06];
  // A value that is constant up to rounding has a span of a few ulp: no ticks fit in there.
  const rounding = 1e-9 * Math.max(Math.abs(lo), Math.abs(hi));
  const margin =
    hi > lo ? Math.max((hi - lo) * 0.07, rounding) : Math.max(Math.abs(hi) * 0.1, 1e-9);
  return [lo - margin, hi + margin];
}
