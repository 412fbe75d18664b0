// The page of a run that goes on: the head with its Stop button, points as they come in, the end.

const live = {
  ended: null,
  source: null, // of events; none while a stop is being asked for
  place: page.id + '-0', // in the log of this run
  heard: performance.now(),
  lost: false,
  asking: 0, // requests to stop without an answer yet
  stops: 0, // that have been asked for, by whomever: what the program says
  trouble: '',
  log: false,
  tables: false,
  plan: null,
  drawn: -Infinity,
};

const patience = 3000; // ms, for an answer and for a status, due ten times a second

// A token stops one run: that of an earlier one is none.
function takeToken() {
  const found = location.hash.match(/token=([0-9a-f]+)/);
  if (found) {
    sessionStorage.setItem('sinerig-token', page.id + ' ' + found[1]);
    history.replaceState(null, '', location.pathname);
  }
  const [id, token] = (sessionStorage.getItem('sinerig-token') || '').split(' ');
  return id === page.id ? token : null;
}
const token = takeToken();

function buildHead() {
  document.title = page.title + ' – sinerig';
  document.getElementById('head').innerHTML =
    `<div class="title"><h1>${esc(page.title)}</h1><span class="chip" id="chip">running</span><span class="grow"></span>` +
    `<button id="stop"${token ? '' : ' disabled title="Open the address that sinerig run printed to be able to stop."'}>Stop</button></div>` +
    `<p class="about">${esc(page.about)}</p>` +
    `<div class="progress"><span id="progress"></span></div><p class="where trouble" id="trouble" role="alert"></p><p class="where" id="where">waiting for the first tick</p>`;
  document.getElementById('stop').addEventListener('click', stopRun);
}

// The stream goes first: a browser has six connections to a place, and with as many pages open the
// request would wait for one of them without a word.
async function stopRun() {
  ++live.asking;
  live.trouble = '';
  live.source?.close();
  live.source = null;
  drawHead();
  try {
    const answer = await fetch('stop', {
      method: 'POST',
      headers: { 'X-Sinerig-Token': token },
      signal: AbortSignal.timeout(patience),
    });
    if (!answer.ok) throw new Error('Not stopped: ' + (await answer.text()).trim());
    ++live.stops;
  } catch (error) {
    const words = error.name === 'TimeoutError' ? `No answer within ${patience / 1000} s.` : error.message;
    live.trouble = words + ' Use Ctrl-C in the terminal.';
  }
  if (--live.asking === 0) follow();
  drawHead();
}

function stopText() {
  if (live.asking) return 'Asking …';
  if (live.stops === 0) return 'Stop';
  return live.stops === 1 ? 'Stopping – press again for neutral at once' : 'Neutral at once';
}

function drawHead() {
  const s = now.status,
    chip = document.getElementById('chip');
  if (live.ended) {
    chip.textContent = live.ended.outcome_text;
    chip.className = 'chip ' + outcomeClass(live.ended.outcome);
    document.getElementById('stop').hidden = true;
    document.getElementById('trouble').textContent = '';
    document.getElementById('where').textContent =
      (s ? duration(s.elapsed_s) + ' of bench time; ' : '') +
      (live.ended.files.length ? 'wrote ' + live.ended.files.join(' and ') : '');
    if (live.ended.outcome === 'done') document.getElementById('progress').style.width = '100%';
    return;
  }
  document.getElementById('stop').textContent = stopText();
  document.getElementById('trouble').textContent = live.trouble;
  chip.textContent = live.lost ? 'no connection' : 'running';
  chip.className = 'chip ' + (live.lost ? 'bad' : 'running');
  if (!s) return;
  document.getElementById('progress').style.width = (100 * s.done).toFixed(2) + '%';
  document.getElementById('where').innerHTML =
    placeText(s) +
    (s.hz ? ` · <b>${tonesText(s.hz)}</b>` : '') +
    ` · ${duration(s.elapsed_s)} elapsed · ` +
    (s.remaining_s === null
      ? '<b id="left">as long as it takes</b>'
      : `<b id="left">${duration(s.remaining_s)}</b> left`);
}

// Columns that belong to a point each; those in `extra` come and go.
const ownColumns = columns => Object.keys(columns).filter(key => key !== 'r' && key !== 'extra');

function append(columns) {
  const r = page.responses[columns.r];
  if (!r) return;
  const before = r.f.length,
    added = columns.f.length;
  for (const key of ownColumns(columns)) r[key].push(...columns[key]);
  const nothing = n => Array.from({ length: n }, () => null);
  for (const name of new Set([...Object.keys(r.extra), ...Object.keys(columns.extra)])) {
    r.extra[name] = (r.extra[name] || nothing(before)).concat(columns.extra[name] || nothing(added));
  }
  const order = r.f.map((f, i) => i).sort((a, b) => r.f[a] - r.f[b]);
  if (order.some((k, i) => k !== i)) {
    const sorted = values => order.map(i => values[i]);
    for (const key of ownColumns(columns)) r[key] = sorted(r[key]);
    for (const name of Object.keys(r.extra)) r.extra[name] = sorted(r.extra[name]);
  }
  derive(r);
}

function takeLog(log) {
  log.responses.forEach(append);
  const { timing, events } = page.runs[0];
  timing.f.push(...log.timing.f);
  timing.late_us.push(...log.timing.late_us);
  timing.faults.push(...log.timing.faults);
  timing.switches.push(...log.timing.switches);
  log.timing.histogram.forEach((n, i) => {
    timing.histogram[i] = (timing.histogram[i] || 0) + n;
  });
  events.push(...log.events);
  for (const { r, f, status, settled } of log.responses)
    if (r === 0 && f.length) live.last = { f: f.at(-1), status: status.at(-1), settled: settled.at(-1) };
  live.log = true;
}

// What the dwell under way tells so far of each of its tones, drawn among the finished points.
function underWay(gain) {
  const s = now.status;
  if (!s || live.ended || !s.hz) return [];
  const valueOf = (r, hz, e) => {
    if (!e) return null;
    if (gain) return inGain(Math.hypot(e.re, e.im));
    let arg = Math.atan2(e.im, e.re);
    const near = r.arg.length ? r.arg[nearest(r.f, hz)] : null;
    if (near !== null && !state.wrapped) arg += turn * Math.round((near - arg) / turn);
    return inPhase(arg);
  };
  return page.responses.flatMap((r, i) =>
    state.shown[i]
      ? [
          {
            style: colour(r),
            f: s.hz,
            y: s.hz.map((hz, tone) => valueOf(r, hz, s.estimates[i][tone])),
            marks: true,
            status: s.hz.map(() => 'now'),
          },
        ]
      : [],
  );
}

function withUnderWay(spec, gain) {
  const finished = spec.layers;
  return { ...spec, layers: () => finished().concat(underWay(gain)) };
}

// The small plots appear when there is something to show in them.
function refreshSmall() {
  const extras = [...new Set(page.responses.flatMap(r => Object.keys(r.extra)))];
  const shown = ['late_us', 'faults', 'switches'].filter(key =>
    page.runs[0].timing[key].some(v => v > 0),
  );
  const signature = ['gain95', 'snr', 'coherence', 'distortion', 'amplitude', 'response']
    .filter(has)
    .concat(extras, shown)
    .join();
  if (signature === live.small) return;
  live.small = signature;
  const host = document.getElementById('small');
  host.innerHTML = '';
  plots.splice(3);
  smallPlots(host);
}

function draw(time) {
  live.plan = null;
  drawHead();
  drawNow();
  if (live.log || live.ended) {
    live.log = false;
    live.tables = true;
    refreshSmall();
    plots.forEach(plot => plot.render());
    showReadout();
  } else {
    plots.slice(0, 2).forEach(plot => plot.render());
  }
  // Hundreds of rows are the dear part; statuses come ten times a second.
  if (live.tables && (time - live.drawn > 1000 || live.ended)) {
    live.drawn = time;
    live.tables = false;
    writeTables(document.getElementById('tables'));
  }
}

function schedule() {
  if (live.plan === null) live.plan = requestAnimationFrame(draw);
}

function heard() {
  live.heard = performance.now();
  live.lost = false;
  schedule();
}

function follow() {
  if (live.ended) return;
  const source = (live.source = new EventSource('events?since=' + live.place));
  source.addEventListener('log', event => {
    live.place = event.lastEventId;
    takeLog(JSON.parse(event.data));
    heard();
  });
  source.addEventListener('status', event => {
    now.status = JSON.parse(event.data);
    live.stops = now.status.stop_requests;
    heard();
  });
  source.addEventListener('end', event => {
    source.close();
    live.ended = JSON.parse(event.data);
    page.outcome = live.ended.outcome;
    schedule();
  });
  // Another run has taken the place of this one.
  source.addEventListener('reload', () => {
    source.close();
    location.reload();
  });
  source.addEventListener('error', () => {
    live.lost = true;
    // Refused, for too many follow: the browser does not try again by itself.
    if (source.readyState === EventSource.CLOSED && live.source === source) setTimeout(follow, patience);
    schedule();
  });
}

// A connection that says nothing breaks without an error.
function watch() {
  if (live.ended || live.lost || performance.now() - live.heard < patience) return;
  live.lost = true;
  schedule();
}

function buildLive() {
  shapes.now = (x, y, r) => shapes.good(x, y, r * 1.7);
  buildHead();
  buildNow();
  document.getElementById('main').innerHTML =
    '<div class="sheet"><div class="stack" id="bode"></div><div class="stack" id="plane"></div></div><div class="small" id="small"></div><div id="tables"></div>';
  const bode = document.getElementById('bode');
  new Plot(bode, withUnderWay(gainPlot(), true));
  new Plot(bode, withUnderWay(phasePlot(), false));
  new Nyquist(document.getElementById('plane'));
  document.getElementById('foot').innerHTML = page.notes.map(n => `<p>${esc(n)}</p>`).join('');
  writeBar();
  renderAll();
  addEventListener('resize', () => {
    plots.forEach(plot => plot.render());
    drawNow();
  });
  follow();
  setInterval(watch, 250);
  // The address of another run, token and all, pasted over this one's loads nothing by itself.
  addEventListener('hashchange', () => location.reload());
}

buildLive();
