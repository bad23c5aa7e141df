// What the scripts beside this page hand over, and the arrays packed in it.
"use strict";
const vinesexp = { held: { traces: new Map(), facts: new Map() } };
vinesexp.traces = (id, content) => vinesexp.held.traces.set(id, content);
vinesexp.facts = (id, content) => vinesexp.held.facts.set(id, content);

// A page from disk may load scripts, but no data: each record's content is a script.
function load(kind, id) {
  const held = vinesexp.held[kind];
  if (held.has(id)) return Promise.resolve(held.get(id));
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = `pages/${kind}/${encodeURIComponent(id)}.js`;
    script.onload = () => { script.remove(); held.has(id) ? resolve(held.get(id)) : reject(new Error(id)); };
    script.onerror = () => { script.remove(); reject(new Error(`${script.src} is not there`)); };
    document.head.append(script);
  });
}

// Few records are kept: traces of a thousand would fill the memory.
function forget(keep) {
  const held = vinesexp.held.traces;
  for (const id of [...held.keys()].slice(0, -4)) if (id !== keep) held.delete(id);
}

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));

function unpack(packed) {
  if (!packed) return new Float64Array(0);
  if (packed.float64 !== undefined) return new Float64Array(bytes(packed.float64).buffer);
  const steps = new Int16Array(bytes(packed.int16).buffer);
  return Float64Array.from(steps, s => s === -32768 ? NaN : packed.offset + packed.scale * s);
}

// A channel between two times, as a band of smallest and largest values or as a line of samples.
// A part shorter than a cycle but too long to show it would beat with the oscillation.
function shown(trace, channel, from, to, width) {
  const { start, rate, part, frequency } = trace, step = part / rate, n = channel.low.length;
  const first = Math.max(Math.floor((from - start) / step) - 1, 0);
  const last = Math.min(Math.ceil((to - start) / step) + 2, n);
  let merge = Math.max(Math.ceil((last - first) / width), 1);
  const period = frequency ? 1 / frequency : Infinity;
  if (merge > 1 && merge * step > period / 8) merge = Math.ceil(Math.ceil(merge * step / period) * period / step);
  const x = [], low = [], high = [];
  for (let i = first - first % merge; i < last; i += merge) {
    const end = Math.min(i + merge, n), begin = Math.max(end - merge, 0);
    let least = Infinity, most = -Infinity;
    for (let j = begin; j < end; j++) {
      if (channel.low[j] < least) least = channel.low[j];
      if (channel.high[j] > most) most = channel.high[j];
    }
    const gap = least > most;
    x.push(start + (0.5 * (i + end) * part - 0.5) / rate);
    low.push(gap ? NaN : least);
    high.push(gap ? NaN : most);
  }
  return { x, low, high, samples: part === 1 && merge === 1, fine: merge === 1 };
}

// Every sample of the windows between two times, with gaps between windows.
function windowed(trace, channel, from, to) {
  const x = [], y = [];
  let at = 0;
  for (const [begin, end] of trace.windows) {
    const t0 = trace.start + begin / trace.rate, t1 = trace.start + end / trace.rate;
    if (t1 >= from && t0 <= to) {
      for (let i = begin; i < end; i++) { x.push(trace.start + i / trace.rate); y.push(channel.windows[at + i - begin]); }
      x.push(t1); y.push(NaN);
    }
    at += end - begin;
  }
  return { x, y };
}
