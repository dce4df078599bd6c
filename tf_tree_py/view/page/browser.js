// SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
// SPDX-License-Identifier: Apache-2.0

// Reports to the server what viser does not: the address, the size of the picture, and the last
// beat that has arrived. Shows a red bar when no beats arrive.

const OURS = ['t', 'fixed', 'chosen', 'camera', 'dark'];
const SILENT_MS = 4000;
const REPORT_MS = 100;
// viser sends the changes of all controls through one throttle of 50 ms, which keeps only the last
// change of any control. A report just after a change by a person would therefore replace it. So
// no report is written for so many turns after an event in the controls. Turns are counted and not
// milliseconds, because on a busy machine a turn may come before the throttle's overdue timer.
const QUIET_TURNS = 3;
const EVENTS = ['pointerdown', 'pointermove', 'pointerup', 'touchmove', 'touchend', 'click',
  'keydown', 'keyup', 'input', 'wheel'];
let quietTurns = 0;
const setValue = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set;
let lastReport = '';
let lastBeat = '';
let beatAt = Date.now();
let opened = null;

function queryOfOurs() {
  const parameters = new URLSearchParams(window.location.search);
  return OURS.filter(name => parameters.has(name))
    .map(name => `${name}=${parameters.get(name)}`).join('&');
}

function notice(event) {
  if (!event.isTrusted || event.target instanceof HTMLCanvasElement) return;
  if (event.type === 'pointermove' && !event.buttons) return;
  quietTurns = QUIET_TURNS;
}

// On a phone the controls cover a part of the window. The picture gets the other part.
function makeRoom(pulse, canvas) {
  let sheet = pulse;
  while (sheet && getComputedStyle(sheet).position !== 'fixed') sheet = sheet.parentElement;
  let box = canvas;
  while (box && !(box.style.flexGrow === '1' && box.style.height)) box = box.parentElement;
  if (!box) return;
  if (sheet) {
    sheet.style.width = '100%';
    sheet.style.maxHeight = '55%';
    sheet.querySelectorAll('[style*="20em"]').forEach(part => { part.style.width = '100%'; });
  }
  const height = sheet ? `${Math.round(sheet.getBoundingClientRect().top)}px` : '100%';
  if (box.style.height !== height) box.style.height = height;
}

function report() {
  const pulse = document.querySelector('.tf-reports');
  const field = pulse?.parentElement?.nextElementSibling?.querySelector('input');
  const canvas = [...document.querySelectorAll('canvas')]
    .sort((one, other) => other.clientWidth - one.clientWidth)[0];
  if (pulse && pulse.dataset.beat !== lastBeat) {
    lastBeat = pulse.dataset.beat;
    beatAt = Date.now();
  }
  showSilence(pulse !== null && Date.now() - beatAt > SILENT_MS);
  if (!field || !canvas) return;
  makeRoom(pulse, canvas);
  if (quietTurns > 0) {
    quietTurns -= 1;
    return;
  }
  opened ??= queryOfOurs();
  const text = JSON.stringify({
    beat: Number(lastBeat), query: opened,
    width: canvas.clientWidth, height: canvas.clientHeight});
  if (text === lastReport) return;
  lastReport = text;
  setValue.call(field, text);
  field.dispatchEvent(new Event('input', {bubbles: true}));
}

function showSilence(silent) {
  let sign = document.getElementById('tf-silent');
  if (!silent) {
    sign?.remove();
    return;
  }
  if (!sign) {
    sign = document.createElement('div');
    sign.id = 'tf-silent';
    sign.style.cssText = 'position: fixed; top: 0; left: 0; right: 0; z-index: 10000;'
      + 'background: #c92a2a; color: white; padding: 0.6em 1em; font: bold 15px sans-serif;'
      + 'text-align: center; pointer-events: none;';
    document.body.append(sign);
  }
  const seconds = Math.round((Date.now() - beatAt) / 1000);
  sign.textContent = `The server does not answer. This page is ${seconds} s old.`;
}

window.tfWrite = query => {
  const others = [...new URLSearchParams(window.location.search)]
    .filter(([name]) => !OURS.includes(name)).map(([name, value]) => `${name}=${value}`);
  const all = [...others, ...(query ? [query] : [])].join('&');
  window.history.replaceState(null, '', window.location.pathname + (all ? `?${all}` : ''));
};

window.addEventListener('popstate', () => { opened = queryOfOurs(); });
clearInterval(window.tfReports);
window.tfReports = setInterval(report, REPORT_MS);
if (window.tfNotice) EVENTS.forEach(kind => window.removeEventListener(kind, window.tfNotice, true));
window.tfNotice = notice;
EVENTS.forEach(kind => window.addEventListener(kind, notice, {capture: true, passive: true}));

window.tfPicture = name => {
  const canvas = [...document.querySelectorAll('canvas')]
    .sort((one, other) => other.clientWidth - one.clientWidth)[0];
  canvas.toBlob(picture => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(picture);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
};
