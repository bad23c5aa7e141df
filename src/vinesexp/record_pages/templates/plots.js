// Figures of one record: all over the same time axis, redrawn for what is in view.
"use strict";
// Parts drawn at most: one a pixel of what is left of the page beside the axis.
const pixels = () => Math.max(Math.min(byId("plots").clientWidth - 80, 1400), 200);
const MOST_MARKS = 4000;
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = () => matchMedia("screen and (prefers-color-scheme: dark)").matches;
const LIGHTER = { "#0072B2": "#4aa8e0", "#333333": "#c9d0d6", "#000000": "#f0f3f5", "#D55E00": "#ff8a3c", "#009E73": "#35c79c" };

function colour(name) {
  const found = vinesexp.content.colours[name];
  return dark() ? LIGHTER[found] || found : found;
}

function figure(title, height, x_range, more = {}) {
  const B = Bokeh.Plotting;
  const tools = more.tools || "xpan,xwheel_zoom,xbox_zoom,reset,save";
  const plot = new B.figure({ height, tools, x_range, sizing_mode: "stretch_width", title: null,
    y_axis_label: title, background_fill_color: null, border_fill_color: null, outline_line_color: null,
    output_backend: "canvas", min_border_left: 62, stylesheets: [":host { break-inside: avoid; }"], ...more.options });
  plot.toolbar.logo = null;
  plot.toolbar.autohide = true;
  for (const tool of plot.toolbar.tools) if (tool.type === "WheelZoomTool") tool.modifiers = { ctrl: true };
  for (const axis of [...plot.xaxis, ...plot.yaxis]) {
    axis.axis_label_text_color = axis.major_label_text_color = css("--ink");
    axis.axis_line_color = axis.major_tick_line_color = css("--soft");
    axis.minor_tick_line_color = null;
    axis.formatter.power_limit_low = -7;  // 0.0005 rather than 5.000e-4
    axis.axis_label_text_font_style = "normal";
    axis.axis_label_text_font_size = axis.major_label_text_font_size = "12px";
  }
  for (const grid of [...plot.xgrid, ...plot.ygrid]) grid.grid_line_color = css("--line");
  return plot;
}

function hover(plot, renderers, tooltips) {
  plot.add_tools(new Bokeh.HoverTool({ renderers, tooltips, mode: "mouse" }));
}

const source = columns => new Bokeh.ColumnDataSource({ data: columns });

const KINDS = { measured: "raw", bandpassed: "filtered" };

// One figure a channel: raw faint, filtered over it.
function channelFigures(trace, x_range, updates) {
  const roles = [...new Set(trace.channels.map(c => c.role))];
  return roles.map(role => {
    const own = trace.channels.filter(c => c.role === role && document.getElementById(c.kind).checked);
    if (!own.length) return null;
    const plot = figure(`${role} (${own[0].unit})`, 190, x_range);
    own.sort((a, b) => (a.kind === "measured" ? 0 : 1) - (b.kind === "measured" ? 0 : 1));
    for (const channel of own) {
      const faint = channel.kind === "measured" && own.length > 1;
      const tint = faint ? css("--soft") : colour(role);
      const band = source({ x: [], low: [], high: [] }), line = source({ x: [], y: [] });
      const name = KINDS[channel.kind];
      const area = plot.varea({ x: { field: "x" }, y1: { field: "low" }, y2: { field: "high" }, source: band, fill_color: tint, fill_alpha: 1, legend_label: name });
      const edge = plot.line({ x: { field: "x" }, y: { field: "high" }, source: band, line_color: tint, line_width: 1 });
      plot.line({ x: { field: "x" }, y: { field: "y" }, source: line, line_color: tint, line_width: 1.2, line_alpha: faint ? 0.6 : 1, legend_label: name });
      updates.push((from, to) => {
        const found = shown(trace, channel, from, to, pixels());
        area.glyph.fill_alpha = faint ? 0.4 : 0.85;
        edge.glyph.line_alpha = faint ? 0.3 : 0.9;
        band.data = found.samples ? { x: [], low: [], high: [] } : { x: found.x, low: found.low, high: found.high };
        line.data = found.samples ? { x: found.x, y: found.low } : { x: [], y: [] };
      });
    }
    styleLegend(plot);
    if (role === "acceleration" && trace.impacts.time.length) marks(plot, trace, updates);
    return plot;
  }).filter(Boolean);
}

const WALLS = [[1, "wall +1", "inverted_triangle", "impact +1"], [-1, "wall −1", "triangle", "impact -1"], [0, "impact", "diamond", "impact"]];

function impactsIn(trace, side, from, to) {
  const { time } = trace.impacts, found = [];
  for (let i = 0; i < time.length; i++) if (trace.impacts.side[i] === side && time[i] >= from && time[i] <= to) found.push(i);
  const step = Math.ceil(found.length / MOST_MARKS);
  return step > 1 ? found.filter((_, k) => k % step === 0) : found;
}

function columnsOf(trace, indices) {
  const m = trace.impacts, pick = values => indices.map(i => values[i]);
  return { x: pick(m.time), size: indices.map(i => Math.abs(m.jump[i])), jump: pick(m.jump), error: pick(m.error), nes: pick(m.nes),
    low: indices.map(i => Math.abs(m.jump[i]) - m.error[i]), high: indices.map(i => Math.abs(m.jump[i]) + m.error[i]),
    sure: indices.map(i => m.confidence[i]), note: indices.map(i => m.notes.get(i) || "") };
}

const TIPS = [["time", "@x{0.00000} s"], ["ball", "@nes"], ["velocity jump", "@jump{0.0000} ± @error{0.0000} m/s"], ["confidence", "@sure{0.000}"], ["", "@note"]];

// Impacts above and below the acceleration, by ball and wall.
function marks(plot, trace, updates) {
  const shown = [];
  for (const [side, name, marker, tint] of WALLS) {
    if (!trace.impacts.side.includes(side)) continue;
    const data = source({ ...columnsOf(trace, []), y: [] });
    const drawn = plot.scatter({ x: { field: "x" }, y: { field: "y" }, source: data, marker, size: 7, fill_color: colour(tint), line_color: null });
    shown.push(drawn);
    updates.push((from, to, reach) => {
      const columns = columnsOf(trace, impactsIn(trace, side, from, to));
      data.data = { ...columns, y: columns.x.map(() => (side < 0 ? -1.1 : 1.1) * reach) };
    });
  }
  hover(plot, shown, TIPS);  // the figure of the jumps below names the walls
}

function styleLegend(plot) {
  if (!plot.legend) return;
  const legend = plot.legend;
  Object.assign(legend, { orientation: "horizontal", location: "top_right", background_fill_alpha: 0.6, background_fill_color: css("--paper"),
    label_text_color: css("--ink"), border_line_color: null, label_text_font_size: "11px", padding: 2, margin: 2 });
}

function jumpFigure(trace, x_range, updates) {
  if (!trace.impacts.time.length) return null;
  const plot = figure("velocity jump (m/s)", 170, x_range), drawn = [];
  for (const [side, name, marker, tint] of WALLS) {
    if (!trace.impacts.side.includes(side)) continue;
    const data = source(columnsOf(trace, []));
    plot.segment({ x0: { field: "x" }, x1: { field: "x" }, y0: { field: "low" }, y1: { field: "high" }, source: data, line_color: colour(tint), line_alpha: 0.6 });
    drawn.push(plot.scatter({ x: { field: "x" }, y: { field: "size" }, source: data, marker, size: 5, fill_color: colour(tint), line_color: null, legend_label: name }));
    updates.push((from, to) => { data.data = columnsOf(trace, impactsIn(trace, side, from, to)); });
  }
  styleLegend(plot);
  hover(plot, drawn, TIPS);
  return plot;
}

const COUNTS = ["none", "one", "two", "three or more"];

// Impacts in each cycle: one row a ball, equal neighbours joined.
function stripFigure(trace, x_range) {
  if (!trace.strips.length) return null;
  const names = trace.strips.map(s => s.name || "ball");
  const plot = figure("impacts\nper cycle", 104 + 22 * names.length, x_range, { options: { y_range: new Bokeh.FactorRange({ factors: [...names].reverse() }) } });
  const tints = [css("--paper"), "#e9a877", colour("two symmetric"), colour("three or more per cycle")];
  const columns = COUNTS.map(() => ({ left: [], right: [], y: [] }));
  trace.strips.forEach((strip, k) => {
    const period = 1 / trace.frequency, counts = strip.counts.map(c => Math.min(c, 3));
    for (let i = 0, begin = 0; i < counts.length; i++) {
      if (i + 1 < counts.length && counts[i + 1] === counts[i]) continue;
      const { left, right, y } = columns[counts[i]];
      left.push(trace.start + begin * period); right.push(trace.start + (i + 1) * period); y.push(names[k]);
      begin = i + 1;
    }
  });
  COUNTS.forEach((count, k) => {
    if (!columns[k].left.length) return;
    const bars = plot.hbar({ left: { field: "left" }, right: { field: "right" }, y: { field: "y" }, source: source(columns[k]), height: 0.8,
      fill_color: tints[k], line_color: k ? null : css("--line"), legend_label: count });
    hover(plot, [bars], [["impacts per cycle", count], ["from", "@left{0.00} s"], ["to", "@right{0.00} s"]]);
  });
  styleLegend(plot);
  const legend = plot.legend;  // above the strips, which fill the whole frame
  plot.center = plot.center.filter(one => one !== legend);
  plot.add_layout(legend, "above");
  for (const grid of plot.ygrid) grid.grid_line_color = null;
  return plot;
}

function interpolate(x, y, at) {
  let j = 0;
  return Array.from(at, t => {
    while (j + 1 < x.length && x[j + 1] < t) j++;
    if (!x.length || t < x[0] || t > x[x.length - 1]) return NaN;
    const k = Math.min(j + 1, x.length - 1);
    return x[k] === x[j] ? y[j] : y[j] + (y[k] - y[j]) * (t - x[j]) / (x[k] - x[j]);
  });
}

// Amplitude of each cycle beside its fit (ring-down) or its replay; below, what the fit leaves.
function amplitudeFigures(trace, facts, x_range) {
  const cycles = trace.cycles, fits = [];
  if (!cycles || !cycles.time.length) return [];
  const plot = figure("amplitude (mm)", 190, x_range);
  const replayed = facts.replayed;
  if (replayed) {
    const time = Array.from(unpack(replayed.time), t => t + trace.start);
    const [median, low, high] = ["median", "low", "high"].map(key => Array.from(unpack(replayed[key])));
    plot.varea({ x: time, y1: low, y2: high, fill_color: colour("exact"), fill_alpha: 0.25 });
    plot.line({ x: time, y: median, line_color: colour("exact"), line_width: 1.6, legend_label: "replayed: median, range" });
    fits.push(["measured −\nreplayed (mm)", time, median]);
  }
  const decay = trace.decay;
  if (decay) {
    const time = Array.from(unpack(decay.time)), viscous = Array.from(unpack(decay.viscous)), law = Array.from(unpack(decay.law));
    plot.line({ x: time, y: viscous, line_color: colour("published"), line_dash: "dashed", legend_label: "viscous fit" });
    plot.line({ x: time, y: law, line_color: colour("impact"), legend_label: "fit" });
    fits.push(["measured −\nfit (mm)", time, law]);
  }
  const x = Array.from(cycles.time), y = Array.from(cycles.amplitude);
  const drawn = plot.scatter({ x, y, size: 3, fill_color: colour("measured"), line_color: null, legend_label: "measured" });
  styleLegend(plot);
  hover(plot, [drawn], [["time", "@x{0.000} s"], ["amplitude", "@y{0.0000} mm"]]);
  plot.y_range.start = 0;
  if (!fits.length) return [plot];
  const [name, time, fit] = fits[fits.length - 1], model = interpolate(time, fit, x);
  const residual = figure(name, 140, x_range);
  residual.scatter({ x, y: y.map((v, i) => v - model[i]), size: 3, fill_color: colour("measured"), line_color: null });
  return [plot, residual];
}

function manifoldFigure(facts) {
  const curve = vinesexp.content.manifold, points = facts.manifold;
  if (!curve || !points) return null;
  const C = Array.from(unpack(points.C)), A = Array.from(unpack(points.A));
  const reach = Math.max(1.9, 1.05 * [...C].sort((a, b) => a - b)[Math.floor(0.99 * (C.length - 1))]);
  const top = 1.1 * Math.max(0.6, ...A);
  const plot = figure("amplitude A (clearances)", 380, new Bokeh.Range1d({ start: 0, end: reach }),
    { tools: "pan,wheel_zoom,box_zoom,reset,save", options: { x_axis_label: "ball amplitude C (clearances)", y_range: new Bokeh.Range1d({ start: 0, end: top }) } });
  const kinds = { stable: [colour("two symmetric"), "solid", 2.4], unstable: [colour("base"), "dashed", 1.6] };
  for (const part of curve.parts) {
    const [tint, dash, width] = kinds[part.kind];
    plot.line({ x: part.C, y: part.A, line_color: tint, line_dash: dash, line_width: width, legend_label: part.kind });
  }
  const number = C.map((_, i) => i + 1);
  plot.line({ x: C, y: A, line_color: css("--soft"), line_alpha: 0.3 });
  const dots = plot.scatter({ x: { field: "C" }, y: { field: "A" }, source: source({ C, A, number }), size: 4, fill_color: colour("measured"), line_color: null });
  plot.scatter({ x: [C[0]], y: [A[0]], size: 11, fill_color: null, line_color: colour("measured") });
  for (const name of ["T1", "T2"]) {
    plot.scatter({ x: [curve[name][0]], y: [curve[name][1]], size: 8, fill_color: colour("two symmetric"), line_color: null });
    plot.text({ x: [curve[name][0]], y: [curve[name][1]], text: [name], text_color: css("--ink"), x_offset: -4, y_offset: 24, text_font_size: "12px" });
  }
  styleLegend(plot);
  hover(plot, [dots], [["impact", "@number"], ["C", "@C{0.000}"], ["A", "@A{0.000}"]]);
  return plot;
}

// Amplitude spectral density of each channel over the whole record, both axes logarithmic.
function spectrumFigures(trace) {
  return trace.spectra.map(one => {
    const x = Array.from(unpack(one.frequency)), y = Array.from(unpack(one.density), v => 10 ** v);
    const plot = figure(`${one.role} (${one.unit.includes("/") ? `(${one.unit})` : one.unit}/√Hz)`, 210, new Bokeh.Range1d({ start: x[0], end: x[x.length - 1] }),
      { tools: "pan,wheel_zoom,box_zoom,reset,save", options: { x_axis_type: "log", y_axis_type: "log", x_axis_label: "frequency (Hz)" } });
    for (let k = 1; trace.frequency && k <= 5; k++) {
      const at = k * trace.frequency;
      if (at < x[x.length - 1]) plot.add_layout(new Bokeh.Span({ dimension: "height", location: at, line_color: css("--soft"), line_dash: k === 1 ? "dashed" : "dotted", line_width: 1, line_alpha: 0.7 }));
    }
    const line = plot.line({ x: { field: "x" }, y: { field: "y" }, source: source({ x, y }), line_color: colour(one.role), line_width: 1.2 });
    plot.add_tools(new Bokeh.HoverTool({ renderers: [line], mode: "vline", tooltips: [["frequency", "@x{0.000} Hz"], ["density", "@y{0.00e+0}"]] }));
    return plot;
  });
}

const MOST_POINTS = 6000;

// Displacement and velocity of the mass between two times, and one point a cycle at the same phase.
function phaseFigure(trace, updates) {
  if (!trace.phase) return null;
  const time = unpack(trace.phase.time), px = unpack(trace.phase.x), pv = unpack(trace.phase.v), { each } = trace.phase;
  let reach = 0;
  for (let i = 0; i < px.length; i++) reach = Math.max(reach, Math.abs(px[i]), Math.abs(pv[i]));
  const range = () => new Bokeh.Range1d({ start: -1.08 * reach, end: 1.08 * reach });
  const plot = figure("velocity / (2πf) (mm)", 420, range(), { tools: "pan,wheel_zoom,box_zoom,reset,save",
    options: { x_axis_label: "displacement (mm)", y_range: range(), match_aspect: true } });
  plot.sizing_mode = "fixed";
  plot.width = Math.min(460, byId("plots").clientWidth);
  plot.height = plot.width - 40;  // less the axis on the left: a circle is one
  const path = source({ x: [], y: [] }), section = source({ x: [], y: [] });
  plot.line({ x: { field: "x" }, y: { field: "y" }, source: path, line_color: colour("displacement"), line_alpha: 0.55, line_width: 1, legend_label: "motion" });
  plot.scatter({ x: { field: "x" }, y: { field: "y" }, source: section, size: 5, fill_color: colour("impact"), line_color: null, legend_label: "once a cycle" });
  styleLegend(plot);
  updates.push((from, to) => {
    const rows = { x: [], y: [] }, dots = { x: [], y: [] }, inside = [];
    for (let i = 0; i < time.length; i++) if (time[i] >= from && time[i] <= to) inside.push(i);
    for (const i of inside) if (i % each === 0) { dots.x.push(px[i]); dots.y.push(pv[i]); }
    for (const i of inside.slice(-MOST_POINTS)) { rows.x.push(px[i]); rows.y.push(pv[i]); }
    path.data = rows;
    section.data = dots;
  });
  return plot;
}
