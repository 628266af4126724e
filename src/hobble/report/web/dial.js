// A dial with whole values from 0 to `most`. It is drawn as an arc. People turn it by dragging, clicking or pressing keys.
const NS = "http://www.w3.org/2000/svg";
const FROM = -130, SWEEP = 260; // where the arc starts and how far it goes, degrees clockwise from the top
const R = 46; // radius of the arc in units of the viewBox; its centre is at (60, 60)

// The point [x, y] on the arc at the share `turn` of its length.
const arcPoint = (turn) => {
  const angle = (FROM + SWEEP * turn - 90) * Math.PI / 180;
  return [60 + R * Math.cos(angle), 60 + R * Math.sin(angle)];
};
// The SVG path of the arc between two shares of its length.
const arcPath = (from, to) => {
  const [a, b] = [arcPoint(from), arcPoint(to)];
  return `M${a[0].toFixed(2)} ${a[1].toFixed(2)}A${R} ${R} 0 ${SWEEP * (to - from) > 180 ? 1 : 0} 1 ${b[0].toFixed(2)} ${b[1].toFixed(2)}`;
};

// host: an element with the role "slider", into which the dial is drawn. value: at the start. changed(value): called when a person has turned the
// dial, but not by `set`.
export const createDial = (host, { most = 10, value = 0, changed }) => {
  const svg = document.createElementNS(NS, "svg"), parts = {};
  svg.setAttribute("viewBox", "0 0 120 108");
  svg.setAttribute("aria-hidden", "true");
  for (const [name, tag] of [["track", "path"], ["fill", "path"], ["knob", "circle"], ["number", "text"], ["unit", "text"]]) {
    parts[name] = document.createElementNS(NS, tag);
    parts[name].setAttribute("class", name);
    svg.append(parts[name]);
  }
  parts.track.setAttribute("d", arcPath(0, 1));
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
      const turn = dial.value / most, [x, y] = arcPoint(turn);
      parts.fill.setAttribute("d", turn ? arcPath(0, turn) : "");
      parts.knob.setAttribute("cx", x);
      parts.knob.setAttribute("cy", y);
      parts.number.textContent = dial.value;
      host.setAttribute("aria-valuenow", dial.value);
      host.style.setProperty("--turn", turn);
    },
  };
  const turnTo = (to) => {
    const before = dial.value;
    dial.set(to);
    if (dial.value !== before) changed(dial.value);
  };
  const turnToPointer = (event) => {
    const box = svg.getBoundingClientRect(), scale = 120 / box.width;
    const [x, y] = [(event.clientX - box.x) * scale - 60, (event.clientY - box.y) * scale - 60];
    const degrees = Math.atan2(x, -y) * 180 / Math.PI;
    turnTo(most * Math.min(1, Math.max(0, (degrees - FROM) / SWEEP)));
  };
  host.addEventListener("pointerdown", (event) => { host.setPointerCapture(event.pointerId); turnToPointer(event); });
  host.addEventListener("pointermove", (event) => { if (host.hasPointerCapture(event.pointerId)) turnToPointer(event); });
  const keySteps = {
    ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 3, PageDown: -3, Home: -most, End: most,
  };
  host.addEventListener("keydown", (event) => {
    if (!(event.key in keySteps) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    turnTo(dial.value + keySteps[event.key]);
  });
  dial.set(value);
  return dial;
};
