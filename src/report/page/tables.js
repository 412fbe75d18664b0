// Words and tables: the head, the readout at the cursor, points, events, facts, the rig file.

const outcomeClass = outcome => (outcome === 'done' ? 'good' : outcome === 'interrupted' ? 'warn' : 'bad');
const sharedUnit = responses => {
  const units = [...new Set(responses.map(r => r.unit))];
  return units.map(u => (u === '1' ? '1' : '1 ' + u)).join(' and ');
};

function writeHead() {
  const fact = f =>
    `<div><dt>${esc(f[0])}</dt><dd>${esc(f[1])}${f[2] ? ` <small>${esc(f[2])}</small>` : ''}</dd></div>`;
  const outcome = page.outcome
    ? `<span class="outcome ${outcomeClass(page.outcome)}">${esc(page.outcome_text)}</span>`
    : '';
  document.getElementById('head').innerHTML =
    `<div class="title"><h1>${esc(page.title)}</h1>${outcome}</div><p class="about">${esc(page.about)}</p>` +
    `<dl class="facts">${page.summary.map(fact).join('')}</dl>`;
}

function statusText(r, i) {
  const reason = r.reason[i] ? ', ' + r.reason[i].replace(/_/g, ' ') : '';
  const way = r.settled && r.settled[i] === 'model' ? ', transient modelled' : '';
  return `<span class="status-${plain(r.status[i]) ? 'good' : 'other'}">${esc(r.status[i].replace(/_/g, ' ') + reason + way)}</span>`;
}

function readoutRow(r) {
  const i = nearest(r.f, state.at);
  if (Math.abs(Math.log(r.f[i] / state.at)) > 0.05)
    return `<b class="name">${esc(r.name)}</b> <span class="num"><i>no point here</i></span>`;
  const phase = phaseOf(r)[i];
  const pieces = [
    `<b class="name">${esc(r.name)}</b>`,
    `<span class="num" data-value="gain">${state.db ? withInterval(inGain(r.abs[i]), gainHalf(r, i), 3) : significant(r.abs[i], 5)} <i>${gainUnit()}</i></span>`,
    `<span class="num" data-value="phase">${withInterval(phase, phaseHalf(r, i), state.degrees ? 2 : 4)}<i>${state.degrees ? '°' : ' rad'}</i></span>`,
  ];
  if (r.snr[i] !== null) pieces.push(`<span><i>SNR</i> ${fixed(r.snr[i], 0)} <i>dB</i></span>`);
  if (r.coherence[i] !== null) pieces.push(`<span><i>coherence</i> ${fixed(r.coherence[i], 6)}</span>`);
  if (r.amplitude[i] !== null)
    pieces.push(`<span><i>${esc(r.input)}</i> ${significant(r.amplitude[i], 3)} <i>${esc(r.input_unit)}</i></span>`);
  if (r.distortion[i] > 0)
    pieces.push(`<span><i>distortion</i> ${significant(100 * r.distortion[i], 2)} <i>%</i></span>`);
  pieces.push(statusText(r, i));
  return pieces.join('');
}

function showReadout() {
  const host = document.querySelector('.readout');
  if (state.at === null) {
    host.innerHTML =
      '<span class="at"><i>point at a plot</i></span><span class="keys"><i>drag to zoom · click to keep the cursor · ← → from point to point · Esc to go back</i></span>';
    return;
  }
  host.innerHTML =
    `<span class="at">${significant(inFrequency(state.at), 6)} ${frequencyUnit()}${state.pinned ? ' <i>kept</i>' : ''}</span>` +
    shownResponses()
      .filter(r => r.f.length)
      .map(r => `<div class="row">${readoutRow(r)}</div>`)
      .join('');
}

function pointsTable(r) {
  const phase = phaseOf(r);
  const extra = Object.keys(r.extra);
  const head = [
    frequencyUnit(),
    'gain' + (state.db ? ' dB' : ''),
    '± 95 %',
    'phase ' + phaseUnit(),
    '± 95 %',
    'SNR dB',
    'coherence',
    `${r.input} ${r.input_unit}`,
    `response ${r.output_unit}`,
    'distortion %',
    'samples',
    ...extra.map(name => name.replace(/_/g, ' ')),
  ];
  const rows = r.f.map((f, i) => {
    const g = gainHalf(r, i),
      p = phaseHalf(r, i);
    const cells = [
      significant(inFrequency(f), 6),
      state.db ? fixed(inGain(r.abs[i]), decimals(g, 3)) : significant(r.abs[i], 5),
      significant(g, 2),
      fixed(phase[i], decimals(p, state.degrees ? 2 : 4)),
      significant(p, 2),
      fixed(r.snr[i], 0),
      fixed(r.coherence[i], 6),
      significant(r.amplitude[i], 4),
      significant(r.response[i], 4),
      significant(r.distortion[i] === null ? null : 100 * r.distortion[i], 2),
      r.samples[i] === null ? '–' : Math.round(r.samples[i]),
      ...extra.map(name => significant(r.extra[name][i], 3)),
    ];
    return `<tr data-f="${f}">${cells.map(c => `<td class="n">${c}</td>`).join('')}<td>${statusText(r, i)}</td></tr>`;
  });
  return `<div class="scroll points"><table><thead><tr>${head.map(h => `<th class="n">${esc(h)}</th>`).join('')}<th>status</th></tr></thead><tbody>${rows.join('')}</tbody></table></div>`;
}

function markRow() {
  for (const row of document.querySelectorAll('.points tbody tr')) {
    row.classList.toggle('at', state.at !== null && Math.abs(+row.dataset.f - state.at) < 1e-6 * state.at);
  }
}

function simpleTable(head, rows, numeric) {
  const cell = (tag, v, i) =>
    `<${tag}${numeric.includes(i) ? ' class="n"' : tag === 'td' && i === head.length - 1 ? ' class="wrap"' : ''}>${v}</${tag}>`;
  return (
    `<div class="scroll"><table><thead><tr>${head.map((h, i) => cell('th', esc(h), i)).join('')}</tr></thead><tbody>` +
    rows.map(row => `<tr>${row.map((v, i) => cell('td', v, i)).join('')}</tr>`).join('') +
    '</tbody></table></div>'
  );
}

const section = (title, note, body, open) =>
  `<details class="panel"${open ? ' open' : ''}><summary>${esc(title)}<span>${esc(note)}</span></summary>${body}</details>`;

function toml(text) {
  return esc(text)
    .split('\n')
    .map(line => {
      const hash = line.search(/#/);
      const code = hash < 0 ? line : line.slice(0, hash),
        comment = hash < 0 ? '' : `<span class="c">${line.slice(hash)}</span>`;
      if (/^\s*\[/.test(code) && !code.includes('=')) return `<span class="h">${code}</span>${comment}`;
      return code.replace(/^(\s*[\w.-]+)(\s*=)/, '<span class="k">$1</span>$2') + comment;
    })
    .join('\n');
}

function eventsTable(run) {
  const rows = run.events.map(e => [
    significant(e.tick / run.rate_hz, 6),
    e.dwell + 1,
    esc(e.kind.replace(/_/g, ' ')),
    esc(e.channel),
    esc(e.text),
  ]);
  return simpleTable(['time s', 'dwell', 'event', 'channel', 'detail'], rows, [0, 1]);
}

const count = (n, one, many) => `${n} ${n === 1 ? one : many}`;

function writeTables(host) {
  const opened = new Set(
    [...host.querySelectorAll('details[open] > summary')].map(s => s.firstChild.textContent),
  );
  const first = !host.innerHTML;
  let html = loopSections() + driftSections();
  for (const r of shownResponses())
    html += section('Points of ' + r.name, count(r.f.length, 'point', 'points'), pointsTable(r), false);
  for (const d of page.differences) {
    html += section(
      'Differences, ' + d.name,
      d.verdict,
      simpleTable(
        ['Hz', 'gain dB', '± 95 %', 'phase °', '± 95 %', 'p', 'verdict'],
        d.f.map((f, i) => [
          significant(f, 6),
          fixed(d.gain_db[i], 4),
          significant(d.gain95_db[i], 2),
          fixed(d.phase_deg[i], 3),
          significant(d.phase95_deg[i], 2),
          significant(d.p[i], 2),
          d.changed[i] ? '<span class="status-other">changed</span>' : '',
        ]),
        [0, 1, 2, 3, 4, 5],
      ),
      false,
    );
  }
  for (const r of shownResponses())
    for (const m of r.models) {
      html += section(
        `Model of ${r.name}`,
        m.label,
        simpleTable(
          ['', ''],
          m.facts.map(f => f.map(esc)),
          [],
        ),
        false,
      );
    }
  for (const run of page.runs) {
    const of = page.runs.length > 1 ? ' of ' + run.label : '';
    if (run.events.length)
      html += section(
        'Events' + of,
        count(run.events.length, 'event', 'events'),
        eventsTable(run),
        first && page.outcome !== 'done',
      );
    html += section(
      'Run' + of,
      'who, when, where, with what',
      simpleTable(
        ['', ''],
        run.facts.map(f => f.map(esc)),
        [],
      ),
      false,
    );
    if (run.rig_text)
      html += section('Rig file' + of, run.rig_name, `<pre>${toml(run.rig_text)}</pre>`, false);
  }
  host.innerHTML = html;
  for (const details of host.querySelectorAll('details')) {
    if (!first) details.open = opened.has(details.querySelector('summary').firstChild.textContent);
  }
  for (const row of host.querySelectorAll('.points tbody tr')) {
    row.addEventListener('click', () => {
      state.pinned = true;
      moveCursor(+row.dataset.f);
    });
  }
  markRow();
}
