// Tables: a click on a heading sorts all rows, and a button saves them as CSV with all digits. A long table shows its first rows.
import { material, onTheme, save } from "./base.js";
import { drawAll } from "./charts.js";
import { views } from "./view.js";

const FIRST = 10; // rows that a long table shows at first
const byText = new Intl.Collator("en", { numeric: true }).compare;
// A text in quotes if CSV needs them.
const quoted = (text) => (/[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

// The rows of a table as lists of cells [whole value, shown text]. The page's data have those of long tables, others are in the HTML.
// They are read once, and a click on a heading sorts them.
const read = new Map();
const rowsOf = (table) => {
  if (!read.has(table)) {
    const long = material.tables[table.dataset.csv]?.map((row) => row.map((cell) => (Array.isArray(cell) ? cell : [cell, cell])));
    read.set(table, long ?? [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => [cell.dataset.v ?? cell.textContent, cell.textContent])));
  }
  return read.get(table);
};
// A table as CSV text.
export const csv = (table) => [[...table.tHead.rows[0].cells].map((cell) => cell.textContent.trim()), ...rowsOf(table).map((row) => row.map(([value]) => value.trim()))]
  .map((row) => row.map(quoted).join(",")).join("\r\n") + "\r\n";

const startTable = (table) => {
  const heads = [...table.tHead.rows[0].cells], kinds = heads.map((head) => head.className), more = document.querySelector(`[data-all="${CSS.escape(table.dataset.csv)}"]`);
  let most = more ? FIRST : Infinity;
  const show = () => table.tBodies[0].replaceChildren(...rowsOf(table).slice(0, most).map((row) => {
    const line = document.createElement("tr");
    row.forEach(([value, text], column) => {
      const cell = line.insertCell();
      cell.className = kinds[column];
      cell.textContent = text;
      if (value !== text) cell.dataset.v = value;
    });
    return line;
  }));
  more?.addEventListener("click", () => { most = Infinity; show(); more.remove(); });
  heads.forEach((head, column) => head.addEventListener("click", () => {
    const descending = head.getAttribute("aria-sort") === "ascending", sign = descending ? -1 : 1;
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    rowsOf(table).sort((a, b) => {
      const [x, y] = [a[column][0], b[column][0]];
      if (kinds[column] !== "n") return sign * byText(x, y);
      const [p, q] = [parseFloat(x), parseFloat(y)];
      if (isNaN(p) || isNaN(q)) return isNaN(p) - isNaN(q); // empty cells stay at the end
      return sign * (p - q);
    });
    show();
  }));
};

export const startTables = () => {
  document.querySelectorAll("table[data-csv]").forEach(startTable);
  document.querySelectorAll("[data-download]").forEach((button) => button.addEventListener("click", () => {
    const name = button.dataset.download, table = document.querySelector(`table[data-csv="${CSS.escape(name)}"]`);
    save(new Blob([csv(table)], { type: "text/csv" }), `${name}.csv`);
  }));
};

// Sets the theme, shows Play or the report, opens sections, prepares the page for printing, and marks the present section in the contents.

const startTheme = () => {
  const root = document.documentElement, button = document.getElementById("theme"), themes = ["auto", "light", "dark"];
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
  return { show: () => show(theme), showLight() { root.dataset.theme = "light"; recolour(); } };
};

// Shows the part of the page that has the element of the address, opens its section and scrolls to it. `Play` is shown without an address.
export const showAddress = () => {
  const id = decodeURIComponent(location.hash.slice(1).split("?")[0]), element = id && document.getElementById(id);
  if (document.getElementById("play-page")) document.documentElement.dataset.part = element && element.closest("#report") ? "report" : "play";
  document.querySelectorAll(".tabs a").forEach((link, i) => link.toggleAttribute("aria-current", (i === 1) === (document.documentElement.dataset.part === "report")));
  if (!element) return;
  for (let at = element.querySelector(":scope > details") || element; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
  element.scrollIntoView();
};

export const startPage = () => {
  const theme = startTheme();
  addEventListener("hashchange", showAddress);
  // A click on a link to the present address changes nothing in it, but the section may be closed again.
  document.querySelectorAll('a[href^="#"]').forEach((link) => link.addEventListener("click", () => { if (link.hash === location.hash) showAddress(); }));
  showAddress();

  // For printing, the sections are opened, their charts and 3D views are drawn, and the colours are light.
  let opened = [];
  const openAll = () => {
    theme.showLight();
    opened = [...opened, ...document.querySelectorAll("details:not([open])")];
    opened.forEach((details) => { details.open = true; });
    views.forEach((draw) => draw());
    return drawAll();
  };
  document.getElementById("print").addEventListener("click", async () => { await openAll(); print(); });
  addEventListener("beforeprint", openAll);
  addEventListener("afterprint", () => {
    opened.forEach((details) => { details.open = false; });
    opened = [];
    theme.show();
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
