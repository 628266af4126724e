// A dial from 0 to `most`: an arc that is turned by dragging, by keys, or by a click on it.
const NS = "http://www.w3.org/2000/svg";
const FROM = -130, SWEEP = 260, R = 46; // FROM, SWEEP: where the arc starts and how far it goes, degrees clockwise from the top; R: radius, units of the viewBox

const point = (turn) => {
  const angle = (FROM + SWEEP * turn - 90) * Math.PI / 180;
  return [60 + R * Math.cos(angle), 60 + R * Math.sin(angle)];
};
const arc = (from, to) => {
  const [a, b] = [point(from), point(to)];
  return `M${a[0].toFixed(2)} ${a[1].toFixed(2)}A${R} ${R} 0 ${SWEEP * (to - from) > 180 ? 1 : 0} 1 ${b[0].toFixed(2)} ${b[1].toFixed(2)}`;
};

// host: an element with role "slider". changed(value): called when a person has turned the dial.
export const createDial = (host, { most = 10, value = 0, changed }) => {
  const svg = document.createElementNS(NS, "svg"), parts = {};
  svg.setAttribute("viewBox", "0 0 120 108");
  svg.setAttribute("aria-hidden", "true");
  for (const [name, tag] of [["track", "path"], ["fill", "path"], ["knob", "circle"], ["number", "text"], ["unit", "text"]]) {
    parts[name] = document.createElementNS(NS, tag);
    parts[name].setAttribute("class", name);
    svg.append(parts[name]);
  }
  parts.track.setAttribute("d", arc(0, 1));
  parts.knob.setAttribute("r", 7);
  for (const [name, y, text] of [["number", 70, ""], ["unit", 90, `of ${most}`]]) {
    parts[name].setAttribute("x", 60);
    parts[name].setAttribute("y", y);
    parts[name].textContent = text;
  }
  host.replaceChildren(svg);
  host.setAttribute("aria-valuemin", 0);
  host.setAttribute("aria-valuemax", most);

  const dial = {
    value,
    set(to) {
      dial.value = Math.min(most, Math.max(0, Math.round(to)));
      const turn = dial.value / most, [x, y] = point(turn);
      parts.fill.setAttribute("d", turn ? arc(0, turn) : "");
      parts.knob.setAttribute("cx", x);
      parts.knob.setAttribute("cy", y);
      parts.number.textContent = dial.value;
      host.setAttribute("aria-valuenow", dial.value);
      host.style.setProperty("--turn", turn);
    },
  };
  const give = (to) => {
    const before = dial.value;
    dial.set(to);
    if (dial.value !== before) changed(dial.value);
  };
  const turned = (event) => {
    const box = svg.getBoundingClientRect(), scale = 120 / box.width;
    const [x, y] = [(event.clientX - box.x) * scale - 60, (event.clientY - box.y) * scale - 60];
    const degrees = Math.atan2(x, -y) * 180 / Math.PI;
    give(most * Math.min(1, Math.max(0, (degrees - FROM) / SWEEP)));
  };
  host.addEventListener("pointerdown", (event) => { host.setPointerCapture(event.pointerId); turned(event); });
  host.addEventListener("pointermove", (event) => { if (host.hasPointerCapture(event.pointerId)) turned(event); });
  const keys = {
    ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 3, PageDown: -3, Home: -most, End: most,
  };
  host.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    give(dial.value + keys[event.key]);
  });
  dial.set(value);
  return dial;
};
