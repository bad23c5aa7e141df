"use strict";
const byId = id => document.getElementById(id);
const form = byId("row"), correct = byId("correct"), said = byId("said");
let before = null, record = "", shown = "", version = -1;

/** Put a part's markup in place where it changed; what is folded open stays open. */
function place(name, markup) {
  const part = byId("part-" + name);
  if (part.dataset.markup === markup) return;
  const open = [...part.querySelectorAll("details[open]")].map(one => one.id);
  const focused = part.contains(document.activeElement) ? document.activeElement.dataset.record : null;
  part.dataset.markup = markup;
  part.innerHTML = markup;
  for (const id of open) if (byId(id)) byId(id).open = true;
  if (focused) part.querySelector(`[data-record="${CSS.escape(focused)}"]`)?.focus();
}

/** Figures of the newest record; they come a moment later than its words. */
async function draw() {
  const mark = byId("newest");
  if (!mark || mark.dataset.state !== "done" || mark.dataset.key === shown) return;
  const key = mark.dataset.key;
  const answer = await fetch("figures?record=" + encodeURIComponent(mark.dataset.record));
  if (!answer.ok) return;
  const figures = await answer.json();
  shown = key;
  byId("figures").innerHTML = figures.map(([svg, caption]) => {
    const words = document.createElement("figcaption");
    words.textContent = caption;
    return `<figure tabindex="0">${svg}${words.outerHTML}</figure>`;
  }).join("");
  document.body.dataset.figures = key;
}

async function follow() {
  for (;;) {
    try {
      const answer = await fetch("state?since=" + version);
      if (!answer.ok) throw new Error(answer.status);
      const state = await answer.json();
      version = state.version;
      for (const [name, markup] of Object.entries(state.parts)) place(name, markup);
      document.body.dataset.version = version;
      draw();
    } catch (error) {
      place("status", '<p class="differ">vinesexp watch has ended; this page no longer follows.</p>');
      version = -1;
      await new Promise(done => setTimeout(done, 2000));
    }
  }
}

async function edit(id) {
  const answer = await fetch("row?record=" + encodeURIComponent(id));
  const cells = await answer.json();
  record = id;
  before = {};
  for (const field of form.elements) {
    if (!field.name) continue;
    const text = cells[field.name] || "";
    if (field.type === "checkbox") field.checked = ["yes", "y", "true", "1"].includes(text.toLowerCase());
    else field.value = text;
    before[field.name] = text;
  }
  byId("correct-title").textContent = "Row of " + id;
  said.textContent = answer.ok ? "" : cells.error;
  correct.hidden = false;
  correct.scrollIntoView({block: "nearest"});
  form.elements.clearance_mm.focus();
}

document.addEventListener("click", event => {
  const button = event.target.closest("button[data-record]");
  if (button) edit(button.dataset.record);
});
byId("cancel").addEventListener("click", () => { correct.hidden = true; });
form.addEventListener("submit", async event => {
  event.preventDefault();
  const cells = {}, was = {};
  for (const field of form.elements) {
    if (!field.name) continue;
    const on = ["yes", "y", "true", "1"].includes((before[field.name] || "").toLowerCase());
    const value = field.type === "checkbox"
      ? (field.checked === on ? before[field.name] : field.checked ? "yes" : "")
      : field.value;
    if (value !== before[field.name]) { cells[field.name] = value; was[field.name] = before[field.name]; }
  }
  const answer = await fetch("row", {
    method: "POST",
    headers: {"Content-Type": "application/json"},
    body: JSON.stringify({record, cells, before: was}),
  });
  if (answer.ok) { correct.hidden = true; return; }
  said.textContent = (await answer.json()).error;
});
follow();
