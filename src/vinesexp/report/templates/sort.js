// Tables of the report can be sorted by any column: a click on its head, a second one the other way round.
"use strict";
const superscripts = "⁰¹²³⁴⁵⁶⁷⁸⁹";

// The number that a cell begins with, with its power of ten; its text where there is none.
function worth(cell) {
  const text = cell.textContent.trim().replace("−", "-"), found = text.match(/^[(<>]?\s*([+-]?\d[\d.]*)/);
  if (!found) return text;
  const power = text.match(/10⁻([⁰¹²³⁴⁵⁶⁷⁸⁹]+)/);
  return Number(found[1]) * (power ? 10 ** -[...power[1]].reduce((n, c) => 10 * n + superscripts.indexOf(c), 0) : 1);
}

function compare(a, b) {
  const numbers = typeof a === "number" && typeof b === "number";
  if (numbers) return a - b;
  if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;  // dashes after numbers
  return a.localeCompare(b, "en", { numeric: true });
}

for (const table of document.querySelectorAll(".wide table")) {
  const [head, ...rows] = table.rows;
  if (rows.length < 3 || !head.querySelector("th")) continue;
  [...head.cells].forEach((cell, column) => {
    if (cell.tagName !== "TH") return;
    const button = document.createElement("button");
    button.type = "button";
    button.append(...cell.childNodes);
    cell.append(button);
    button.addEventListener("click", () => {
      const way = cell.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      for (const other of head.cells) other.removeAttribute("aria-sort");
      cell.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
      const keyed = rows.map(row => [worth(row.cells[column]), row]);
      keyed.sort((a, b) => way * compare(a[0], b[0]));
      for (const [, row] of keyed) row.parentNode.append(row);
    });
  });
}
