// Tables: a click on a heading sorts by it, and a button saves the table as CSV with all digits.
import { onTheme, save } from "./base.js";
import { drawAll } from "./charts.js";
import { views } from "./view.js";

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

// Sets the theme, prepares the page for printing, and marks the current section in the list of contents.

export const startPage = () => {
  const root = document.documentElement, button = document.getElementById("theme");
  const themes = ["auto", "light", "dark"];
  const remembered = () => { try { return localStorage.getItem("hobble-theme"); } catch { return null; } };
  const remember = (name) => { try { localStorage.setItem("hobble-theme", name); } catch { /* no storage: the next visit starts with the automatic theme */ } };
  const recolour = () => onTheme.forEach((react) => react());
  const show = (name) => {
    if (name === "auto") delete root.dataset.theme; else root.dataset.theme = name;
    button.textContent = `Theme: ${name}`;
    recolour();
  };
  const requested = new URLSearchParams(location.search).get("theme");
  let theme = [requested, remembered()].find((name) => themes.includes(name)) || "auto";
  if (theme !== "auto") show(theme);
  button.addEventListener("click", () => {
    theme = themes[(themes.indexOf(theme) + 1) % themes.length];
    remember(theme);
    show(theme);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", recolour);

  // For printing, all charts and 3D views are drawn, folded tables with fewer than 120 rows are opened, and the colours are light.
  document.getElementById("print").addEventListener("click", () => print());
  let opened = [];
  addEventListener("beforeprint", () => {
    root.dataset.theme = "light";
    opened = [...document.querySelectorAll("details:not([open])")].filter((d) => d.querySelectorAll("tr").length < 120);
    opened.forEach((details) => { details.open = true; });
    recolour();
    drawAll();
    views.forEach((draw) => draw());
  });
  addEventListener("afterprint", () => {
    opened.forEach((details) => { details.open = false; });
    show(theme);
  });

  const links = new Map([...document.querySelectorAll("nav a")].map((a) => [a.hash.slice(1), a]));
  const seen = new Set(); // ids of the sections on the screen
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) seen[entry.isIntersecting ? "add" : "delete"](entry.target.id);
    const here = [...links.keys()].find((id) => seen.has(id));
    links.forEach((link, id) => {
      if (id !== here) { link.removeAttribute("aria-current"); return; }
      link.setAttribute("aria-current", "true");
      const strip = link.closest("ol"); // on a narrow screen the contents scroll sideways
      if (strip.scrollWidth > strip.clientWidth) strip.scrollLeft = link.offsetLeft - 24;
    });
  }, { rootMargin: "-20% 0px -60%" });
  document.querySelectorAll("main section[id]").forEach((section) => watch.observe(section));
};
