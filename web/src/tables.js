// Tables that are sorted by a click on a heading.

export function sortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const rows = [...table.tBodies[0].rows];
      const keys = new Map(rows.map((row) => [row, key(row.cells[column])]));
      rows.sort((a, b) => (up ? 1 : -1) * compare(keys.get(a), keys.get(b)));
      table.tBodies[0].append(...rows);
    });
  });
}

// Lengths sort by millimetres, whatever the unit that is shown.
function key(cell) {
  const length = [cell, ...cell.children].find((one) => one.matches("[data-mm], [data-mm2]"));
  if (length) return Number(length.dataset.mm ?? length.dataset.mm2);
  const text = cell.textContent.trim();
  const number = Number.parseFloat(text);
  return /^-?[\d.]+( \w+)?$/.test(text) && Number.isFinite(number) ? number : text;
}

function compare(a, b) {
  if (typeof a === "number" && typeof b === "number") return a - b;
  if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
  return a.localeCompare(b, undefined, { numeric: true });
}
