// Draws charts in the page's colours when they scroll into view, and again when the theme changes.
import library from "plotly"; // as zlib data in base64, see bundle.py
import { colour, inflate, material, onTheme } from "./base.js";

// Unpacking and running plotly.js takes long, so it is done only before the first chart is drawn.
let loading = null;
const loadPlotly = () => (loading ??= inflate(library).then((text) => new Promise((done, failed) => {
  const script = document.createElement("script");
  script.src = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  Object.assign(script, { onload: done, onerror: failed });
  document.head.append(script);
})));

// Draws every chart that is not in a closed section, for printing.
export let drawAll = async () => {};

export const startCharts = () => {
  // The value with the colour of a token in place of each text "@token".
  const resolve = (value) => {
    if (typeof value === "string") return value[0] === "@" ? colour(value.slice(1)) : value;
    if (Array.isArray(value)) return value.map(resolve);
    if (value && typeof value === "object") {
      return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, resolve(item)]));
    }
    return value;
  };
  // A copy of `base` with the entries of `over`. Objects that are in both are merged, too.
  const merge = (base, over) => {
    const out = { ...base };
    for (const [key, value] of Object.entries(over || {})) {
      const nested = value && typeof value === "object" && !Array.isArray(value) && out[key];
      out[key] = nested ? merge(out[key], value) : value;
    }
    return out;
  };
  const axis = () => ({
    gridcolor: "@line", zerolinecolor: "@line", linecolor: "@line", tickcolor: "@line",
    title: { standoff: 10, font: { size: 12, color: "@soft" } }, tickfont: { size: 11.5, color: "@soft" },
  });
  const layout = (spec, narrow) => resolve(merge({
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", autosize: true,
    modebar: { orientation: "v", bgcolor: "rgba(0,0,0,0)", color: "@faint", activecolor: "@accent" },
    font: { family: getComputedStyle(document.body).fontFamily, size: 12.5, color: "@ink" },
    margin: { l: narrow ? 40 : 56, r: narrow ? 12 : 44, t: 30, b: 48 },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 12, color: "@soft" } },
    hoverlabel: { bgcolor: "@raised", bordercolor: "@line", font: { color: "@ink" } },
    colorway: ["@accent", "@muted"], dragmode: narrow ? false : "zoom", bargap: 0.3,
    xaxis: axis(), yaxis: { ...axis(), automargin: true },
  }, spec.layout));
  const chosenOptions = new Map(); // element of each drawn chart -> index of the option that the reader chose

  const draw = async (element) => {
    await loadPlotly();
    const spec = material.charts[element.dataset.chart];
    if (!spec) return;
    const narrow = element.clientWidth < 520;
    const chosen = spec.options[chosenOptions.get(element) || 0];
    const config = {
      displaylogo: false, responsive: true, displayModeBar: narrow ? false : "hover",
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "sendChartToCloud", "sendDataToCloud"],
      toImageButtonOptions: { format: "svg", filename: spec.name },
    };
    const traces = resolve(chosen.traces), fullLayout = layout(merge(spec, { layout: chosen.layout ?? {} }), narrow);
    if (!chosenOptions.has(element)) chosenOptions.set(element, 0);
    globalThis.Plotly.react(element, traces, fullLayout, config);
  };
  drawAll = () => Promise.all([...document.querySelectorAll("[data-chart]")].filter((each) => each.offsetParent).map(draw));
  document.querySelectorAll("[data-height]").forEach((each) => { each.style.minHeight = `${each.dataset.height}px`; });

  document.querySelectorAll("[data-chooses]").forEach((select) => {
    select.addEventListener("change", () => {
      for (const name of select.dataset.chooses.split(" ")) {
        const element = document.querySelector(`[data-chart="${CSS.escape(name)}"]`);
        chosenOptions.set(element, select.selectedIndex);
        draw(element);
      }
    });
  });
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) { near.unobserve(entry.target); draw(entry.target); }
    }
  }, { rootMargin: "600px" });
  document.querySelectorAll("[data-chart]").forEach((element) => near.observe(element));
  onTheme.push(() => { for (const element of chosenOptions.keys()) draw(element); });
};
