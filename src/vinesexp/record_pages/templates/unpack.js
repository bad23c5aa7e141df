// What the scripts beside this page hand over, and the arrays packed in it.
"use strict";
const vinesexp = { held: { traces: new Map(), facts: new Map(), samples: new Map() } };
vinesexp.traces = (id, content) => vinesexp.held.traces.set(id, content);
vinesexp.samples = (name, content) => vinesexp.held.samples.set(name, content);
vinesexp.facts = (id, content) => vinesexp.held.facts.set(id, content);

// A page from disk may load scripts, but no data: each record's content is a script.
function load(kind, id) {
  const held = vinesexp.held[kind];
  if (held.has(id)) return Promise.resolve(held.get(id));
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = `pages/${kind}/${id.split("/").map(encodeURIComponent).join("/")}.js`;
    script.onload = () => { script.remove(); held.has(id) ? resolve(held.get(id)) : reject(new Error(id)); };
    script.onerror = () => { script.remove(); reject(new Error(`${script.src} is not there`)); };
    document.head.append(script);
  });
}

// Few records are kept: traces of a thousand would fill the memory.
function forget(keep) {
  const { traces, samples } = vinesexp.held;
  for (const id of [...traces.keys()].slice(0, -4)) if (id !== keep) traces.delete(id);
  for (const name of [...samples.keys()].slice(0, -4)) samples.delete(name);
}

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));

function unpack(packed) {
  if (!packed) return new Float64Array(0);
  if (packed.float64 !== undefined) return new Float64Array(bytes(packed.float64).buffer);
  const steps = new Int16Array(bytes(packed.int16).buffer);
  return Float64Array.from(steps, s => s === -32768 ? NaN : packed.offset + packed.scale * s);
}

// Samples as differences, deflated: all low bytes, then all high ones, small numbers of either sign folded.
async function unsqueeze(content) {
  const stream = new Blob([bytes(content.deflated)]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer()), n = planes.length / 2;
  const steps = new Int16Array(n);
  for (let i = 0; i < n; i++) {
    const folded = planes[i] | planes[n + i] << 8;
    steps[i] = (folded >> 1) ^ -(folded & 1);
  }
  for (let order = 0; order < content.order; order++) for (let i = 1; i < n; i++) steps[i] += steps[i - 1];
  return { steps, offset: content.offset, scale: content.scale };
}

// The chunks of samples that a view needs: where parts are wider than a pixel, and not too many of them.
function chunksFor(trace, from, to, width) {
  if (!trace.chunk || (to - from) * trace.rate / trace.part > width) return [];
  const first = Math.max(Math.floor((from - trace.start) * trace.rate / trace.chunk), 0);
  const last = Math.min(Math.floor((to - trace.start) * trace.rate / trace.chunk), Math.floor((trace.samples - 1) / trace.chunk));
  return last - first > 2 ? [] : Array.from({ length: last - first + 1 }, (_, i) => `${trace.id}/${first + i}`);
}

async function loadChunk(name) {
  const chunk = await load("samples", name);
  if (chunk.ready) return chunk;
  const found = {};
  for (const [channel, content] of Object.entries(chunk.channels)) found[channel] = await unsqueeze(content);
  return Object.assign(chunk, { channels: found, ready: true });
}

// A channel between two times: every sample as a line where there are fewer than two a pixel, else a band of
// smallest and largest values. A part shorter than a cycle but too long to show it would beat with the oscillation.
function shown(trace, channel, from, to, width) {
  const names = chunksFor(trace, from, to, width), chunks = names.map(name => vinesexp.held.samples.get(name));
  if (names.length && chunks.every(chunk => chunk && chunk.ready)) return fromSamples(trace, channel, chunks, from, to, width);
  const { start, rate, part, frequency } = trace, step = part / rate, n = channel.low.length;
  const first = Math.max(Math.floor((from - start) / step) - 1, 0);
  const last = Math.min(Math.ceil((to - start) / step) + 2, n);
  if (part === 1 && last - first <= 2 * width) {
    const x = Array.from({ length: last - first }, (_, i) => start + (first + i) / rate);
    return { x, low: Array.from(channel.low.subarray(first, last)), samples: true };
  }
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
  return { x, low, high, samples: false };
}

function fromSamples(trace, channel, chunks, from, to, width) {
  const { start, rate } = trace, key = `${channel.kind} ${channel.role}`;
  const first = Math.max(Math.floor((from - start) * rate) - 1, chunks[0].begin);
  const last = Math.min(Math.ceil((to - start) * rate) + 2, chunks[chunks.length - 1].end);
  const merge = last - first <= 2 * width ? 1 : Math.ceil((last - first) / width);
  const x = [], low = [], high = [];
  let c = 0;
  for (let i = first - first % merge; i < last; i += merge) {
    let least = Infinity, most = -Infinity;
    for (let j = Math.max(i, chunks[0].begin); j < Math.min(i + merge, last); j++) {
      while (j >= chunks[c].end) c++;
      const { steps, offset, scale } = chunks[c].channels[key], s = steps[j - chunks[c].begin];
      if (s === -32768) continue;
      const value = offset + scale * s;
      if (value < least) least = value;
      if (value > most) most = value;
    }
    const gap = least > most;
    x.push(start + (i + 0.5 * (merge - 1)) / rate);
    low.push(gap ? NaN : least);
    high.push(gap ? NaN : most);
  }
  return { x, low, high, samples: merge === 1 };
}
