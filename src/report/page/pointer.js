// Cursor and zoom: hover or touch moves the cursor, a drag zooms, a click pins, a double click or Esc
// goes back, the arrow keys step from point to point.

function moveCursor(hz) {
  if (hz === null) state.at = null;
  else {
    const first = shownResponses().find(r => r.f.length);
    state.at = first ? first.f[nearest(first.f, hz)] : null;
  }
  plots.forEach(plot => plot.placeCursor());
  showReadout();
  markRow();
}

function zoom(range) {
  const [lo, hi] = fullRange();
  state.range =
    range && range[1] / range[0] > 1.0005 ? [Math.max(range[0], lo), Math.min(range[1], hi)] : null;
  if (state.range && state.range[0] >= state.range[1]) state.range = null;
  renderAll();
}

function attachPointer(plot) {
  const { box } = plot;
  let from = null;
  const position = event => event.clientX - box.getBoundingClientRect().left;
  box.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    from = position(event);
    box.setPointerCapture(event.pointerId);
  });
  box.addEventListener('pointermove', event => {
    const p = position(event);
    if (from !== null && Math.abs(p - from) > 5) {
      const a = Math.max(margin.left, Math.min(from, p)),
        b = Math.min(box.clientWidth - margin.right, Math.max(from, p));
      plot.over.innerHTML = `<rect class="drag" x="${a}" y="${margin.top}" width="${Math.max(0, b - a)}" height="${plot.spec.height - margin.top - margin.bottom}"/>`;
    } else if (!state.pinned && p >= margin.left - 6) {
      moveCursor(plot.x.invert(p));
    }
  });
  box.addEventListener('pointerup', event => {
    const p = position(event);
    if (from !== null && Math.abs(p - from) > 5)
      zoom([plot.x.invert(Math.min(from, p)), plot.x.invert(Math.max(from, p))]);
    else if (from !== null) {
      state.pinned = !state.pinned;
      moveCursor(plot.x.invert(p));
    }
    from = null;
  });
  box.addEventListener('pointercancel', () => {
    from = null;
    plot.placeCursor();
  });
  box.addEventListener('pointerleave', () => {
    if (!state.pinned && from === null) moveCursor(null);
  });
  box.addEventListener('dblclick', () => {
    state.pinned = false;
    zoom(null);
  });
}

function stepCursor(direction) {
  const first = shownResponses().find(r => r.f.length);
  if (!first) return;
  const [lo, hi] = state.range || fullRange();
  const at = state.at === null ? (direction > 0 ? -1 : first.f.length) : nearest(first.f, state.at);
  const next =
    state.at === null
      ? first.f.findIndex(f => f >= lo && f <= hi)
      : Math.min(first.f.length - 1, Math.max(0, at + direction));
  state.pinned = true;
  moveCursor(first.f[Math.max(0, next)]);
}

document.addEventListener('keydown', event => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === 'Escape') {
    state.pinned = false;
    moveCursor(null);
    zoom(null);
  } else if (event.key === 'ArrowRight') stepCursor(1);
  else if (event.key === 'ArrowLeft') stepCursor(-1);
  else return;
  event.preventDefault();
});
