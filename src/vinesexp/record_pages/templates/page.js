// Which record is shown, its time in view, and what keys and buttons do to either.
"use strict";
vinesexp.content = JSON.parse(byId("content").textContent);
const current = { id: null, trace: null, facts: null, range: null, updates: [], views: [] };

function prepare(id, raw) {
  if (raw.ready) return raw;
  if (!raw.channels.length) return Object.assign(raw, { id, ready: true, channels: [] });
  for (const channel of raw.channels) {
    channel.low = unpack(channel.low);
    channel.high = channel.high ? unpack(channel.high) : channel.low;
  }
  const m = raw.impacts;
  for (const key of ["time", "jump", "error", "confidence"]) m[key] = unpack(m[key]);
  m.notes = new Map(m.crowded.map(i => [i, "overlaps another or fits badly"]));
  for (const i of m.clipped) m.notes.set(i, "the acceleration was clipped");
  if (raw.cycles) raw.cycles = { time: unpack(raw.cycles.time), amplitude: unpack(raw.cycles.amplitude) };
  raw.end = raw.start + raw.samples / raw.rate;
  return Object.assign(raw, { id, ready: true });
}

async function show(id) {
  const begun = performance.now();
  const entry = vinesexp.content.records.find(r => r[0] === id);
  byId("record").hidden = !entry;
  byId("list").hidden = Boolean(entry);
  current.id = entry ? id : null;
  if (!entry) {
    byId("title").textContent = document.title.replace(" – vinesexp", "");
    return showRows();
  }
  byId("title").textContent = id;
  neighbours();
  try {
    const [raw, facts] = await Promise.all([load("traces", id), load("facts", id)]);
    if (current.id !== id) return;
    Object.assign(current, { trace: prepare(id, raw), facts });
    factTables(facts, current.trace);
    await draw();
    forget(id);
    document.body.dataset.drawn = `${id} ${(performance.now() - begun).toFixed(0)}`;
  } catch (error) {
    byId("words").replaceChildren(element("p", `This record cannot be shown: ${error.message}`, { className: "odd" }));
    console.error(error);
  }
}

async function draw() {
  const { trace, facts } = current;
  for (const view of current.views) view.remove ? view.remove() : view.clear?.();
  current.views = [];
  current.updates = [];
  byId("plots").replaceChildren();
  for (const id of ["manifold", "spectra", "phase"]) byId(id).replaceChildren();
  byId("traces").hidden = !trace.channels.length;
  for (const id of ["sim", "spectrum", "plane"]) byId(id).hidden = true;
  if (!trace.channels.length) return;
  const range = new Bokeh.Range1d({ start: trace.start, end: trace.end, bounds: null });
  current.range = range;
  for (const button of document.querySelectorAll("[data-do=before], [data-do=after]")) button.disabled = !trace.impacts.count;
  const figures = [...channelFigures(trace, range, current.updates), jumpFigure(trace, range, current.updates),
    stripFigure(trace, range), ...amplitudeFigures(trace, facts, range)].filter(Boolean);
  if (!figures.length) return;
  for (const axis of figures[figures.length - 1].xaxis) axis.axis_label = "time (s)";
  const column = new Bokeh.Column({ children: figures, sizing_mode: "stretch_width" });
  let waiting = false;
  const later = () => { if (!waiting) { waiting = true; requestAnimationFrame(() => { waiting = false; refresh(); }); } };
  range.connect(range.properties.start.change, later);
  range.connect(range.properties.end.change, later);
  const phase = phaseFigure(trace, current.updates);
  refresh();
  current.views.push(await Bokeh.Plotting.show(column, byId("plots")));
  describe(byId("plots"), `traces of ${trace.id} over time; the same numbers are in the tables below`);
  const spectra = spectrumFigures(trace);
  byId("spectrum").hidden = !spectra.length;
  if (spectra.length) {
    const holder = new Bokeh.Column({ children: spectra, sizing_mode: "stretch_width" });
    current.views.push(await Bokeh.Plotting.show(holder, byId("spectra")));
    describe(byId("spectra"), `spectra of the channels of ${trace.id}, as measured`);
    const { resolution, sections } = trace.spectra[0];
    byId("resolution").textContent = `Whole record, as measured: ${sections} half overlapping sections, ${resolution.toPrecision(3)} Hz apart, Hann window.${trace.frequency ? ` Lines: the oscillation (${trace.frequency.toPrecision(4)} Hz) and its multiples.` : ""}`;
  }
  byId("plane").hidden = !phase;
  if (phase) {
    current.views.push(await Bokeh.Plotting.show(phase, byId("phase")));
    describe(byId("phase"), `displacement and velocity of the mass in ${trace.id}`);
  }
  const manifold = manifoldFigure(facts);
  byId("sim").hidden = !manifold;
  if (manifold) {
    current.views.push(await Bokeh.Plotting.show(manifold, byId("manifold")));
    describe(byId("manifold"), `impacts of ${trace.id} on the slow invariant manifold`);
  }
}

function describe(holder, text) {
  holder.setAttribute("role", "img");
  holder.setAttribute("aria-label", text);
}

function refresh() {
  const { start, end } = current.range, trace = current.trace;
  const from = Math.min(start, end), to = Math.max(start, end);
  fetchSamples(trace, from, to);
  const loud = trace.channels.filter(c => c.role === "acceleration" && byId(c.kind).checked);
  let reach = 0;
  for (const channel of loud) {
    const found = shown(trace, channel, from, to, pixels());
    for (let i = 0; i < found.x.length; i++) reach = Math.max(reach, Math.abs(found.low[i]) || 0, Math.abs((found.high || found.low)[i]) || 0);
  }
  for (const update of current.updates) update(from, to, reach || 1);
  let inside = 0;
  for (const time of trace.impacts.time) if (time >= from && time <= to) inside++;
  const width = to - from, digits = Math.min(Math.max(2 - Math.floor(Math.log10(width)), 0), 7);
  byId("where").textContent = `${from.toFixed(digits)} to ${to.toFixed(digits)} s of ${(trace.end - trace.start).toPrecision(4)} s, ${inside} of ${trace.impacts.count} impacts in view`;
}

// Samples that the view needs and that are not here yet; the view is drawn again once they are.
const coming = new Set();
function fetchSamples(trace, from, to) {
  for (const name of chunksFor(trace, from, to, pixels())) {
    const held = vinesexp.held.samples.get(name);
    if ((held && held.ready) || coming.has(name)) continue;
    coming.add(name);
    loadChunk(name).then(() => {
      coming.delete(name);
      document.body.dataset.samples = name;
      if (current.trace === trace) refresh();
    }, error => console.error(error));  // the overview stays
  }
}

function view(from, to) {
  const { trace, range } = current;
  const width = Math.min(Math.max(to - from, 8 / trace.rate), trace.end - trace.start);
  const start = Math.min(Math.max(from, trace.start), trace.end - width);
  range.setv({ start, end: start + width });
}

function impact(direction) {
  const { trace, range } = current, times = trace.impacts.time;
  if (!times.length) return;
  const middle = 0.5 * (range.start + range.end);
  const width = Math.min(range.end - range.start, trace.frequency ? 0.35 / trace.frequency : 0.03);
  const apart = 1e-9 + 1e-6 * width;
  let found = direction > 0 ? times.find(t => t > middle + apart) : undefined;
  if (direction < 0) for (const t of times) if (t < middle - apart) found = t;
  found = found ?? (direction > 0 ? times[times.length - 1] : times[0]);
  view(found - 0.5 * width, found + 0.5 * width);
}

const ACTIONS = {
  in: () => zoom(0.5), out: () => zoom(2), left: () => pan(-0.3), right: () => pan(0.3),
  whole: () => view(current.trace.start, current.trace.end), before: () => impact(-1), after: () => impact(1),
};
function zoom(factor) {
  const { start, end } = current.range, middle = 0.5 * (start + end), half = 0.5 * (end - start) * factor;
  view(middle - half, middle + half);
}
function pan(share) {
  const { start, end } = current.range, step = share * (end - start);
  view(start + step, end + step);
}

function neighbours() {
  const at = filter.shown.findIndex(r => r[0] === current.id);
  byId("place").textContent = at < 0 ? "" : `${at + 1} of ${filter.shown.length}`;
  byId("previous").disabled = at <= 0;
  byId("next").disabled = at >= filter.shown.length - 1;
}
function step(direction) {
  const at = filter.shown.findIndex(r => r[0] === current.id), entry = filter.shown[at + direction];
  if (entry) location.hash = encodeURIComponent(entry[0]);
}

const KEYS = { "+": "in", "=": "in", "-": "out", ArrowLeft: "left", ArrowRight: "right", 0: "whole", n: "after", p: "before" };
addEventListener("keydown", event => {
  if (event.target.closest("input, select, textarea") || event.ctrlKey || event.altKey || event.metaKey || !current.id) return;
  if (event.key === "]" || event.key === "[") step(event.key === "]" ? 1 : -1);
  else if (KEYS[event.key] && current.range) ACTIONS[KEYS[event.key]]();
  else return;
  event.preventDefault();
});
for (const button of document.querySelectorAll("[data-do]")) button.addEventListener("click", () => current.range && ACTIONS[button.dataset.do]());
byId("previous").addEventListener("click", () => step(-1));
byId("next").addEventListener("click", () => step(1));
byId("all").addEventListener("click", event => { event.preventDefault(); location.hash = ""; });
byId("more").addEventListener("click", () => { filter.rows += 5 * PAGE; showRows(); });
byId("filter").addEventListener("submit", event => event.preventDefault());
byId("filter").addEventListener("input", () => {
  filter.rows = PAGE;
  applyFilter();
  current.id ? neighbours() : showRows();
});
for (const id of ["measured", "bandpassed"]) byId(id).addEventListener("change", () => current.trace && draw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => current.trace && draw());

const chosen = () => { try { return decodeURIComponent(location.hash.slice(1)); } catch { return location.hash.slice(1); } };
addEventListener("hashchange", () => show(chosen()));
addEventListener("DOMContentLoaded", () => { fillChoices(); applyFilter(); show(chosen()); });
