// Tables: a click on a heading sorts by it, and a button saves the table as CSV with all digits.
import { save } from "./base.js";

// The value of a cell with all its digits, if it has one, or else its text.
const cellValue = (cell) => cell.dataset.v ?? cell.textContent;
const byText = new Intl.Collator("en", { numeric: true }).compare;

// A text in quotes if CSV needs them.
const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
// A table as CSV text.
export const csv = (table) => [...table.rows]
  .map((row) => [...row.cells].map((cell) => quoted(cellValue(cell).trim())).join(",")).join("\r\n") + "\r\n";

export const startTables = () => {
  document.querySelectorAll("table[data-csv]").forEach((table) => {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => head.addEventListener("click", () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      const numeric = head.classList.contains("n");
      const rows = [...table.tBodies[0].rows];
      rows.sort((a, b) => {
        const [x, y] = [cellValue(a.cells[column]), cellValue(b.cells[column])];
        if (!numeric) return descending ? byText(y, x) : byText(x, y);
        const [p, q] = [parseFloat(x), parseFloat(y)];
        if (isNaN(p) || isNaN(q)) return isNaN(p) - isNaN(q); // empty cells stay at the end
        return descending ? q - p : p - q;
      });
      table.tBodies[0].append(...rows);
    }));
  });
  document.querySelectorAll("[data-download]").forEach((button) => button.addEventListener("click", () => {
    const name = button.dataset.download, table = document.querySelector(`table[data-csv="${CSS.escape(name)}"]`);
    save(new Blob([csv(table)], { type: "text/csv" }), `${name}.csv`);
  }));
};
