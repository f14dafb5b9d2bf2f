// Tables: those of verdicts are sorted and sifted; one that is wider than the page is scrolled with the keys.

// Verdicts after which nothing is to be done.
const SETTLED = ".badge.clean, .badge.explained";

function leading(text) {
  const found = /^[−-]?\d+(\.\d+)?/.exec(text);
  return found ? Number(found[0].replace("−", "-")) : NaN;
}

// Numbers by their size, before all that is none; text by its letters.
function compared(a, b) {
  const [x, y] = [leading(a), leading(b)];
  if (Number.isFinite(x) && Number.isFinite(y)) return x - y;
  if (Number.isFinite(x) !== Number.isFinite(y)) return Number.isFinite(x) ? -1 : 1;
  return a.localeCompare(b);
}

function sortable(table) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  const units = heads.findIndex((head) => head.textContent === "unit");
  const first = [...body.rows];
  heads.forEach((head, column) => {
    const sort = button(head.textContent, () => {
      const falls = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", falls ? "descending" : "ascending");
      const text = (row, at = column) => row.cells[at].textContent.trim();
      // Millimetres and newtons have no order: numbers are sorted among those of their unit
      const measured = units >= 0 && first.some((row) => Number.isFinite(leading(text(row))));
      const group = (row) => first.findIndex((other) => text(other, units) === text(row, units));
      const sign = falls ? -1 : 1;
      body.append(...[...body.rows].sort(
        (a, b) => (measured ? group(a) - group(b) : 0) || sign * compared(text(a), text(b))));
    });
    head.replaceChildren(sort);
  });
}

function siftable(table) {
  const rows = [...table.tBodies[0].rows];
  const open = rows.filter((row) => !row.querySelector(SETTLED));
  const choices = [[`needs attention ${open.length}`, open], [`all ${rows.length}`, rows]];
  const buttons = choices.map(([text, kept], i) => button(text, () => {
    for (const row of rows) row.hidden = !kept.includes(row);
    buttons.forEach((each, k) => each.setAttribute("aria-pressed", String(k === i)));
  }));
  buttons.forEach((each, i) => each.setAttribute("aria-pressed", String(i === 1)));
  table.parentElement.before(html("p", { class: "tools" }, "Verdicts: ", ...buttons));
}

// Only what scrolls is a stop of the tabulator.
function reachable(box) {
  if (box.scrollWidth > box.clientWidth) box.setAttribute("tabindex", "0");
  else box.removeAttribute("tabindex");
}

for (const table of document.querySelectorAll("table[data-verdicts]")) {
  siftable(table);
  sortable(table);
}
const scrolling = new ResizeObserver((entries) => entries.forEach((entry) => reachable(entry.target)));
for (const box of document.querySelectorAll(".scroll")) scrolling.observe(box);
