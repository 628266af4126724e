// What hurts: a severity for each link by its name, with sliders, presets and keys.
import { find } from "./base.js";

// specs: of the figures that are played, which may know different links; changed(): called after every change.
export const createInjuries = (specs, changed) => {
  // What was never hurt in training changes nothing, and so can not be hurt here.
  const links = [...new Set(specs.flatMap((spec) => spec.trained))], severity = new Map(links.map((link) => [link, 0]));
  const sliders = [], injuries = { severity, links };
  injuries.word = (link) => specs.map((spec) => spec.spoken[spec.links.indexOf(link)]).find(Boolean) || link;
  injuries.say = (text) => { const note = find("play-note"); if (note) note.textContent = text; };

  const add = (link, label) => {
    const row = document.createElement("label"), name = document.createElement("span");
    const input = document.createElement("input"), output = document.createElement("output"), number = sliders.length + 1;
    name.textContent = label;
    if (number < 10) {
      const key = document.createElement("kbd");
      key.textContent = number;
      name.append(" ", key);
    }
    Object.assign(input, { type: "range", min: 0, max: 10, step: 1, value: severity.get(link) });
    input.addEventListener("input", () => { severity.set(link, Number(input.value)); told(); });
    row.append(name, input, output);
    find("play-sliders").append(row);
    sliders.push({ input, output, link });
  };
  const told = () => {
    injuries.say("");
    sliders.forEach(({ input, output, link }) => { input.value = output.value = severity.get(link); });
    changed();
  };
  injuries.heal = () => injuries.set([]);
  injuries.set = (pairs) => {
    links.forEach((link) => severity.set(link, 0));
    for (const [link, value] of pairs) {
      if (!severity.has(link) || !(value >= 0 && value <= 10)) continue;
      if (value && !sliders.some((slider) => slider.link === link)) add(link, injuries.word(link));
      severity.set(link, value);
    }
    told();
  };
  injuries.worse = (link, by) => {
    if (!severity.has(link)) return;
    severity.set(link, Math.min(10, Math.max(0, severity.get(link) + by)));
    if (!sliders.some((slider) => slider.link === link)) add(link, injuries.word(link));
    told();
  };
  // The keys 1 to 9; true where one did something.
  injuries.key = (event) => {
    const digit = event.code.match(/^Digit([1-9])$/), slider = digit && sliders[digit[1] - 1];
    if (slider) injuries.worse(slider.link, event.shiftKey ? -2 : 2);
    return Boolean(slider);
  };

  const widest = specs.reduce((best, spec) => (spec.trained.length > best.trained.length ? spec : best), specs[0]);
  const button = (text, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", act);
    find("play-presets").append(made);
  };
  Object.entries(widest.parts).forEach(([label, index]) => add(widest.links[index], label));
  widest.presets.forEach(({ name, severities }) => button(name, () => (
    injuries.set(severities.map(([index, value]) => [widest.links[index], value])))));
  if (links.length) button("Healthy", injuries.heal);
  return injuries;
};
