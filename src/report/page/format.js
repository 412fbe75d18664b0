// Numbers and text for people.

const escapes = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' };
const esc = text => String(text).replace(/[&<>"]/g, c => escapes[c]);

const superscript = n => String(n).replace(/[-\d]/g, c => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));
const minus = text => text.replace('-', '−');

// A power of ten as it is written on an axis or in a cell: 0.002, 500, 2×10⁻⁷.
function power(value, digits) {
  const exponent = Math.floor(Math.log10(Math.abs(value)) + 1e-12);
  if (exponent >= -4 && exponent <= 5) return minus(value.toFixed(Math.max(0, digits - 1 - exponent)));
  const mantissa = (value / 10 ** exponent).toFixed(digits - 1);
  return minus(+mantissa === 1 && digits === 1 ? '10' : mantissa + '×10') + superscript(exponent);
}

// `digits` significant digits; a dash where there is no number.
function significant(value, digits) {
  if (value === null || !Number.isFinite(value)) return '–';
  return value === 0 ? '0' : power(value, digits);
}

// As many decimals as the half-width of its interval makes meaningful: two digits of it.
function decimals(half, otherwise) {
  if (!Number.isFinite(half) || half <= 0) return otherwise;
  return Math.min(otherwise, Math.max(0, 1 - Math.floor(Math.log10(half))));
}

function fixed(value, places) {
  return value === null || !Number.isFinite(value) ? '–' : minus(value.toFixed(places));
}

function withInterval(value, half, places) {
  const d = decimals(half, places);
  const least = 10 ** -d;
  const width = !Number.isFinite(half)
    ? ''
    : half < least / 2
      ? ' ±\u2009<\u2009' + least.toFixed(d)
      : ' ±\u2009' + half.toFixed(d);
  return fixed(value, d) + width;
}

function duration(seconds) {
  const s = Math.round(seconds);
  const two = n => String(n).padStart(2, '0');
  return s < 3600
    ? `${Math.floor(s / 60)}:${two(s % 60)}`
    : `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
}
