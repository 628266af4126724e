// Draws label strips: the contacts, phase, gait, speed and channel values of one clip over time.
import { colour, material, onTheme } from "./base.js";

export const startStrips = () => {
  const strips = material.strips, host = document.getElementById("strip");
  if (!host || !strips || !strips.length) return;
  const select = document.getElementById("strip-clip"), keys = document.getElementById("strip-keys");
  const NS = "http://www.w3.org/2000/svg";
  const add = (parent, name, attributes, text) => {
    const node = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const SHORT = { left_heel: "left heel", left_toe: "left toe", right_heel: "right heel", right_toe: "right toe" };
  // gait -> token of its colour
  const GAITS = { stand: "g0", walk: "g1", jog: "g2", crouch: "g3", jump: "g4", bump: "g5" };

  const draw = () => {
    const strip = strips[select.selectedIndex], width = Math.max(320, host.clientWidth);
    const left = width < 520 ? 70 : 92, right = 14, times = strip.seconds, end = Math.max(.1, strip.length);
    const x = (t) => left + (t / end) * (width - left - right);
    host.replaceChildren();
    const svg = add(host, "svg", { role: "img", "aria-label": `Labels of ${strip.clip}` });
    const label = (text, at, size = 12) => {
      add(svg, "text", { x: left - 10, y: at, "text-anchor": "end", style: `font-size:${size}px` }, text);
    };
    // A bar from time a to time b, s.
    const bar = (a, b, y, fill, opacity = 1) => {
      add(svg, "rect", { x: x(a), y, width: Math.max(1, x(b) - x(a)), height: 11, rx: 2, fill, opacity });
    };
    let y = 8; // where the next strip begins
    for (const [name, spans] of Object.entries(strip.contacts)) {
      label(SHORT[name] || name, y + 10);
      add(svg, "line", { x1: left, x2: width - right, y1: y + 5.5, y2: y + 5.5, stroke: colour("line") });
      spans.forEach(([a, b]) => bar(a, b, y, colour(name.startsWith("left") ? "accent" : "g2")));
      y += 16;
    }
    const curve = (name, values, height, top, stroke) => {
      y += 10;
      label(name, y + height / 2 + 4);
      add(svg, "line", { x1: left, x2: width - right, y1: y + height, y2: y + height, stroke: colour("line") });
      let path = "", last = null;
      values.forEach((value, i) => {
        if (value === null) { last = null; return; }
        const jump = last === null || (name === "phase" && Math.abs(value - last) > top / 2);
        path += `${jump ? "M" : "L"}${x(times[i]).toFixed(1)} ${(y + height * (1 - value / top)).toFixed(1)}`;
        last = value;
      });
      add(svg, "path", { d: path, fill: "none", stroke, "stroke-width": 1.4, "stroke-linejoin": "round" });
      y += height + 4;
    };
    curve("phase", strip.phase, 34, 1, colour("ink"));
    y += 10;
    label("gait", y + 20);
    const base = times.map(() => 0);
    for (const [name, values] of Object.entries(strip.gait)) {
      const upper = values.map((v, i) => base[i] + v);
      const point = (v, i) => `${x(times[i]).toFixed(1)} ${(y + 32 * (1 - v)).toFixed(1)}`;
      const d = `M${upper.map(point).join("L")}L${base.map(point).reverse().join("L")}Z`;
      add(svg, "path", { d, fill: colour(GAITS[name] || "g0"), opacity: .85 });
      upper.forEach((v, i) => { base[i] = v; });
    }
    y += 36;
    const fastest = Math.max(.5, ...strip.speed.filter((v) => v !== null));
    curve("speed", strip.speed, 34, fastest, colour("soft"));
    label(`up to ${fastest.toPrecision(2)} m/s`, y - 5, 10);
    strip.channels.forEach((row) => {
      y += 4;
      label(row.name.length > 15 ? `…${row.name.slice(-14)}` : row.name, y + 10, 10);
      add(svg, "title", {}, row.name);
      row.spans.forEach(([a, b, much]) => bar(a, b, y, colour("hurt-high"), .15 + .85 * much / row.highest));
      y += 13;
    });
    y += 6;
    const step = [.5, 1, 2, 5, 10, 20, 30, 60].find((s) => end / s <= (width - left) / 60) || 120;
    for (let t = 0; t <= end + 1e-6; t += step) {
      add(svg, "line", { x1: x(t), x2: x(t), y1: 4, y2: y, stroke: colour("line"), "stroke-dasharray": "1 3" });
      add(svg, "text", { x: x(t), y: y + 14, "text-anchor": "middle" }, `${t} s`);
    }
    svg.setAttribute("viewBox", `0 0 ${width} ${y + 22}`);
    const cursor = add(svg, "line", { x1: -9, x2: -9, y1: 4, y2: y, stroke: colour("accent") });
    // Shows the gaits with their colours and, under the pointer, the labels of sample i. i: null if the pointer is outside.
    const showKey = (i) => {
      keys.replaceChildren();
      const item = (text, swatch) => {
        const span = document.createElement("span");
        if (swatch) { const dot = document.createElement("i"); dot.style.background = colour(swatch); span.append(dot); }
        span.append(text);
        keys.append(span);
      };
      if (i !== null) item(`${times[i].toFixed(2)} s`);
      if (i !== null) item(strip.phase[i] === null ? "no phase" : `phase ${strip.phase[i].toFixed(2)}`);
      for (const [name, values] of Object.entries(strip.gait)) {
        item(i === null ? name : `${name} ${Math.round(100 * values[i])} %`, GAITS[name] || "g0");
      }
      if (i === null) return;
      item(`${strip.speed[i].toFixed(2)} m/s`);
      const down = Object.entries(strip.contacts).filter(([, s]) => s.some(([a, b]) => a <= times[i] && times[i] < b));
      item(down.map(([name]) => SHORT[name] || name).join(", ") || "no contact");
    };
    showKey(null);
    svg.addEventListener("pointermove", (event) => {
      const at = end * (event.clientX - svg.getBoundingClientRect().left - left) / (width - left - right);
      let i = times.findIndex((t) => t >= at);
      if (i < 0) i = times.length - 1;
      cursor.setAttribute("x1", x(times[i]));
      cursor.setAttribute("x2", x(times[i]));
      showKey(i);
    });
    svg.addEventListener("pointerleave", () => {
      cursor.setAttribute("x1", -9);
      cursor.setAttribute("x2", -9);
      showKey(null);
    });
  };
  select.addEventListener("change", draw);
  addEventListener("resize", () => requestAnimationFrame(draw));
  onTheme.push(draw);
  draw();
};
