"use strict";
// Tables of more than a few rows are sorted by their headings and filtered by a text; without a script they stand as
// they came.

const FEW_TO_SORT = 4;
const FEW_TO_FILTER = 12;

function value_of(cell) {
  const time = cell?.querySelector("time[datetime]");
  if (time) return Date.parse(time.dateTime);
  const text = (cell?.textContent ?? "").trim().replaceAll("−", "-");
  const first = text.match(/^[-+]?[\d.]+(e[-+]?\d+)?/i);
  return first && (cell.classList.contains("figures") || first[0] === text) ? Number(first[0]) : text;
}

function compare(one, other) {
  if (typeof one === "number" && typeof other === "number") return one - other;
  if (typeof one !== typeof other) return typeof one === "number" ? -1 : 1; // what is no number comes last
  return one.localeCompare(other, undefined, { numeric: true });
}

function sort(table, column, heading) {
  const descending = heading.getAttribute("aria-sort") === "ascending";
  for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", descending ? "descending" : "ascending");
  const body = table.tBodies[0];
  const keyed = [...body.rows].map((row) => [value_of(row.cells[column]), row]);
  keyed.sort(([one], [other]) => (descending ? compare(other, one) : compare(one, other)));
  body.append(...keyed.map(([, row]) => row));
}

function sortable(table) {
  [...table.tHead.rows[0].cells].forEach((heading, column) => {
    if (heading.tagName === "TD") return; // without a name
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => sort(table, column, heading));
  });
}

function filterable(table) {
  const label = document.createElement("label");
  const field = document.createElement("input");
  field.type = "search";
  const told = document.createElement("span");
  told.className = "quiet";
  told.setAttribute("role", "status");
  const part = "part" in table.dataset; // of a list that goes on on other pages
  label.append(part ? "Filter this page " : "Filter ", field);
  const line = document.createElement("p");
  line.className = "filter";
  line.append(label, " ", told);
  (table.closest(".wide") ?? table).before(line);
  field.addEventListener("keydown", (event) => event.key === "Enter" && event.preventDefault()); // of a form around it
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s+/);
    const rows = [...table.tBodies[0].rows];
    const has = (row) => words.every((word) => row.textContent.toLowerCase().includes(word));
    for (const row of rows) row.hidden = !has(row) && !row.querySelector("input:checked"); // what is ticked stays in view
    const left = rows.filter((row) => !row.hidden).length;
    told.textContent = field.value ? `${left} of ${rows.length}${part ? " on this page" : ""}` : "";
  });
}

function lists(root) {
  for (const table of root.querySelectorAll("table.list:not(.channels)")) {
    const rows = table.tBodies[0]?.rows.length ?? 0;
    if (rows >= FEW_TO_SORT && table.tHead) sortable(table);
    if (rows >= FEW_TO_FILTER) filterable(table);
  }
}
lists(document);
addEventListener("renewed", (event) => lists(event.target));
