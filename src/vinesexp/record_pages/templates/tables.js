// Tables of one record and the list of all of them; texts go in as text, never as markup.
"use strict";
const byId = id => document.getElementById(id);

function element(name, content, attributes = {}) {
  const made = Object.assign(document.createElement(name), attributes);
  for (const part of [content].flat()) if (part !== null && part !== undefined) made.append(part);
  return made;
}

function table(title, heads, rows, { wide = false, folded = false } = {}) {
  if (!rows.length) return null;
  const body = element("tbody", rows.map(row => element("tr", row.map(cell => element("td", String(cell))), { className: row.outcome || "" })));
  const head = heads.some(Boolean) ? element("thead", element("tr", heads.map(h => h ? element("th", h, { scope: "col" }) : element("td", "")))) : null;
  const found = element("table", [head, body]);
  const holder = wide ? element("div", found, { className: "wide", tabIndex: 0 }) : found;
  if (wide) { holder.setAttribute("role", "region"); holder.setAttribute("aria-label", title); }
  const heading = element("h2", title);
  return element("section", folded ? element("details", [element("summary", heading), holder]) : [heading, holder]);
}

const MOST_ROWS = 200;

// As many digits as the error needs to be seen: four to seven.
function withError(value, error) {
  const digits = error > 0 ? Math.min(Math.max(4, Math.ceil(-Math.log10(error))), 7) : 4;
  return `${value.toFixed(digits)}\u00a0±\u00a0${error.toFixed(digits)}`;
}

function factTables(facts, trace) {
  byId("words").replaceChildren(element("div", [
    table("How it was taken", [], facts.settings),
    table("Regime", [], facts.regime),
  ], { className: "facts" }));
  const impacts = [], m = trace.impacts;
  if (m) for (let i = 0; i < Math.min(m.time.length, MOST_ROWS); i++) {
    impacts.push([m.time[i].toFixed(5), m.nes[i] || "–", m.side[i] > 0 ? "+1" : m.side[i] < 0 ? "−1" : "–",
      withError(m.jump[i], m.error[i]), m.confidence[i].toFixed(3), m.notes.get(i) || ""]);
  }
  const more = m && m.count > impacts.length ? `; the first ${impacts.length} of ${m.count}, all in impacts/${trace.id}.csv` : "";
  byId("tables").replaceChildren(...[
    table("Checks", ["check", "outcome", "detail"], facts.checks, { wide: true }),
    table("What it says of the rig", ["", "method", "value ± 95 % from the noise of the record alone", ""], facts.estimates, { wide: true }),
    facts.estimates.length ? element("p", "± is half of a 95 % interval (coverage factor k = 2). What sensors, clock, masses and clearance add is in the values of the report.", { className: "soft" }) : null,
    table("Replay with the identified rig", ["", "measured", "replayed", ""], facts.replay, { wide: true }),
    table(`Impacts${more}`, ["time (s)", "ball", "wall", "velocity jump (m/s)", "confidence", ""], impacts, { wide: true, folded: true }),
    table("Provenance", [], facts.provenance),
  ].filter(Boolean));
}

// The list, filtered; a thousand rows are shown by the hundred.
const PAGE = 200;
const filter = { shown: [], rows: PAGE };

function fillChoices() {
  const records = vinesexp.content.records;
  for (const [id, column, all] of [["test", 1, "all tests"], ["regime", 4, "all regimes"], ["outcome", 8, "all outcomes"]]) {
    const values = [...new Set(records.map(r => r[column]).filter(Boolean))].sort();
    byId(id).replaceChildren(element("option", all, { value: "" }), ...values.map(v => element("option", v, { value: v })));
  }
}

function applyFilter() {
  const words = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const wanted = [[1, byId("test").value], [4, byId("regime").value], [8, byId("outcome").value]];
  filter.shown = vinesexp.content.records.filter(r =>
    wanted.every(([column, value]) => !value || r[column] === value)
    && words.every(word => r.join(" ").toLowerCase().includes(word)));
  const all = vinesexp.content.records.length;
  byId("count").textContent = filter.shown.length === all ? `${all} records` : `${filter.shown.length} of ${all} records`;
}

function showRows() {
  byId("rows").replaceChildren(...filter.shown.slice(0, filter.rows).map(r => element("tr", [
    element("td", element("a", r[0], { href: `#${encodeURIComponent(r[0])}` })),
    ...r.slice(1, 8).map(cell => element("td", cell)),
    element("td", r[9] ? `${r[8]}: ${r[9]}` : r[8]),
  ], { className: r[8] })));
  byId("more").hidden = filter.shown.length <= filter.rows;
}
