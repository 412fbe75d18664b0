// The page: the switches, and drawing it all again when a choice changes.

function writeBar() {
  const two = (name, a, b, first) =>
    `<span class="group" role="group">${[
      [a, first],
      [b, !first],
    ]
      .map(([label, on]) => `<button data-switch="${name}" aria-pressed="${on}">${label}</button>`)
      .join('')}</span>`;
  const channels =
    page.responses.length > 1
      ? `<span class="group">${page.responses
          .map(
            (r, i) =>
              `<button class="channel" data-channel="${i}" style="${colour(r)}" aria-pressed="${state.shown[i]}">${esc(r.name)}</button>`,
          )
          .join('')}</span>`
      : '';
  document.getElementById('bar').innerHTML =
    `<div class="controls">${channels}<span class="gap"></span>` +
    two('hz', 'Hz', 'rad/s', state.hz) +
    two('db', 'dB', 'absolute', state.db) +
    two('degrees', 'degrees', 'radians', state.degrees) +
    two('wrapped', 'wrapped', 'continuous', state.wrapped) +
    `<span class="group"><button data-action="reset">whole range</button></span>` +
    `<span class="group"><button data-action="theme">light / dark</button></span></div><div class="readout" aria-live="off"></div>`;
  for (const button of document.querySelectorAll('#bar button'))
    button.addEventListener('click', () => press(button));
  showReadout();
}

function press(button) {
  const { switch: name, channel, action } = button.dataset;
  if (name) {
    if (button.getAttribute('aria-pressed') === 'true') return;
    state[name] = !state[name];
  } else if (channel !== undefined) {
    state.shown[channel] = !state.shown[channel];
    if (!state.shown.some(Boolean)) state.shown[channel] = true;
  } else if (action === 'reset') {
    state.range = null;
  } else if (action === 'theme') {
    const dark = matchMedia('(prefers-color-scheme: dark)').matches,
      now = document.documentElement.dataset.theme || (dark ? 'dark' : 'light');
    document.documentElement.dataset.theme = now === 'dark' ? 'light' : 'dark';
    return;
  }
  const selector = name
    ? `[data-switch="${name}"]`
    : channel !== undefined
      ? `[data-channel="${channel}"]`
      : `[data-action="${action}"]`;
  const index = [...document.querySelectorAll(selector)].indexOf(button);
  writeBar();
  document.querySelectorAll(selector)[index].focus();
  renderAll();
}

function renderAll() {
  plots.forEach(plot => plot.render());
  writeTables(document.getElementById('tables'));
  showReadout();
}

function build() {
  writeHead();
  const main = document.getElementById('main');
  main.innerHTML =
    '<div class="sheet"><div class="stack" id="bode"></div><div class="stack" id="plane"></div></div><div class="small" id="small"></div><div id="tables"></div>';
  const [bode, plane, small] = ['bode', 'plane', 'small'].map(id => document.getElementById(id));
  if (page.responses.some(r => r.f.length)) {
    new Plot(bode, gainPlot());
    new Plot(bode, phasePlot());
    if (page.responses.some(r => r.models.length)) {
      new Plot(
        bode,
        againstZero(
          'residual-gain',
          'Residual of the gain',
          () => 'dB, measured over model',
          () => residuals(true),
        ),
      );
      new Plot(
        bode,
        againstZero(
          'residual-phase',
          'Residual of the phase',
          () => (state.degrees ? 'degrees' : 'rad'),
          () => residuals(false),
        ),
      );
    }
    if (page.differences.length) {
      new Plot(
        bode,
        againstZero(
          'difference-gain',
          'Difference of the gain',
          () => 'dB, against the first file',
          () => differences(true),
        ),
      );
      new Plot(
        bode,
        againstZero(
          'difference-phase',
          'Difference of the phase',
          () => (state.degrees ? 'degrees' : 'rad'),
          () => differences(false),
        ),
      );
    }
    if (page.loop) {
      loopPlots(bode);
      bode.insertAdjacentHTML('beforeend', marginsPanel());
    }
    if (page.responses.some(r => r.choe)) choePlots(bode);
    new Nyquist(plane);
    for (const r of page.responses)
      for (const m of r.models) if (m.poles.length) new PoleZeroMap(plane, r, m);
    smallPlots(small);
  } else {
    main.querySelector('.sheet').innerHTML =
      '<section class="panel"><p class="note">No point was finished in this run.</p></section>';
  }
  document.getElementById('foot').innerHTML = page.notes.map(n => `<p>${esc(n)}</p>`).join('');
  writeBar();
  renderAll();
  let width = innerWidth;
  addEventListener('resize', () => {
    if (innerWidth !== width) {
      width = innerWidth;
      plots.forEach(plot => plot.render());
    }
  });
  const redraw = () => plots.forEach(plot => plot.render());
  let closed = [];
  addEventListener('beforeprint', () => {
    closed = [...document.querySelectorAll('details:not([open])')];
    closed.forEach(d => {
      d.open = true;
    });
    redraw();
  });
  addEventListener('afterprint', () => {
    closed.forEach(d => {
      d.open = false;
    });
    redraw();
  });
}
