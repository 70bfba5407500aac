// Tables whose rows can be sorted by a click at the head of a column.

import { element } from "./dom";

export function makeSortable(table: HTMLTableElement): void {
  const heads = [...(table.tHead?.rows[0].cells ?? [])];
  heads.forEach((head, column) => {
    const button = element("button", { type: "button", title: "Sort" }, head.textContent ?? "");
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      sort(table.tBodies[0], column, down ? -1 : 1);
    });
    head.replaceChildren(button);
  });
}

/** Empty cells stay at the end. */
function sort(body: HTMLTableSectionElement, column: number, sign: number): void {
  const rows = [...body.rows].map((row) => ({ row, text: (row.cells[column].textContent ?? "").trim() }));
  rows.sort((a, b) => {
    if (!a.text || !b.text) return Number(!a.text) - Number(!b.text);
    const [x, y] = [Number(a.text), Number(b.text)];
    const both = Number.isFinite(x) && Number.isFinite(y);
    return sign * (both ? x - y : a.text.localeCompare(b.text, "en", { numeric: true }));
  });
  body.append(...rows.map(({ row }) => row));
}
