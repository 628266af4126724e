// The channel values in Play: a value for each column of each channel, with sliders, presets and keys.
import { find } from "./base.js";

export const keyed = (one, column) => `${one.name}/${column}`;
// The channel with parts of the body, if there is one.
export const bodyChannel = (spec) => spec.channels.find((one) => one.regions.length);
// The channel that the top of the page shows: one with parts of the body, else the first with a slider.
export const firstShown = (spec) => {
  const some = spec.channels.filter((one) => Object.keys(one.sliders).length);
  return some.find((one) => one.regions.length) || some[0];
};

// specs: data of the played characters, which may have different channels. changed(): called after every change.
export const createSliders = (specs, changed) => {
  const channels = [];
  for (const one of specs.flatMap((spec) => spec.channels)) { // if channels have the same name, take the one with most trained columns
    const at = channels.findIndex(({ name }) => name === one.name);
    if (at < 0) channels.push(one);
    else if (one.trained.length > channels[at].trained.length) channels[at] = one;
  }
  // Columns that were always 0 in training have no effect, so they are left out.
  const known = (name) => specs.flatMap((spec) => spec.channels.filter((one) => one.name === name).flatMap((one) => one.trained));
  const values = new Map(channels.flatMap((one) => known(one.name).map((column) => [keyed(one, column), 0])));
  const rows = [], panel = { values, channels }, columns = (one) => [...new Set(known(one.name))];
  panel.word = ({ name }, column) => specs.flatMap((spec) => spec.channels.filter((one) => one.name === name))
    .map((one) => one.spoken[one.columns.indexOf(column)]).find(Boolean) || column;
  panel.say = (text) => { const note = find("play-note"); if (note) note.textContent = text; };

  const add = (one, column, label) => {
    const row = document.createElement("label"), name = document.createElement("span");
    const input = document.createElement("input"), output = document.createElement("output"), number = rows.length + 1;
    name.textContent = label;
    if (number < 10) {
      const key = document.createElement("kbd");
      key.textContent = number;
      name.append(" ", key);
    }
    Object.assign(input, { type: "range", min: 0, max: one.highest, step: one.sliderStep, value: 0 });
    input.dataset.channel = one.name;
    input.addEventListener("input", () => { values.set(keyed(one, column), Number(input.value)); show(); });
    row.append(name, input, output);
    find("play-sliders").append(row);
    rows.push({ input, output, one, column });
  };
  const there = (one, column) => rows.some((row) => row.one.name === one.name && row.column === column);
  const put = (one, column, value) => {
    if (!there(one, column)) add(one, column, panel.word(one, column));
    values.set(keyed(one, column), Math.min(one.highest, Math.max(0, value)));
  };
  const show = () => {
    panel.say("");
    rows.forEach(({ input, output, one, column }) => {
      const value = values.get(keyed(one, column));
      input.value = value;
      output.value = one.highest < 5 ? value.toFixed(2) : value;
    });
    changed();
  };
  // Sets columns to values and all other columns to 0. triples: [channel, column, value]. only: a channel; other channels stay as they are.
  panel.set = (triples, only = null) => {
    channels.filter((one) => !only || one === only).forEach((one) => columns(one).forEach((column) => values.set(keyed(one, column), 0)));
    triples.forEach(([one, column, value]) => { if (values.has(keyed(one, column)) && value) put(one, column, value); });
    show();
  };
  // A click or a key adds or subtracts a fifth of the highest value.
  panel.more = (one, column, by) => {
    if (!values.has(keyed(one, column))) return;
    put(one, column, Math.round(1e6 * (values.get(keyed(one, column)) + by * one.highest / 5)) / 1e6);
    show();
  };
  // Handles the keys 1 to 9. Returns true if the key has a slider.
  panel.key = (event) => {
    const digit = event.code.match(/^Digit([1-9])$/), slider = digit && rows[digit[1] - 1];
    if (slider) panel.more(slider.one, slider.column, event.shiftKey ? -1 : 1);
    return Boolean(slider);
  };
  // The state in a link: "column:value,column:value" for each channel.
  panel.state = () => Object.fromEntries(channels.flatMap((one) => {
    const some = columns(one).map((column) => [column, values.get(keyed(one, column))]).filter(([, value]) => value > 0);
    return some.length ? [[one.key, some.map(([column, value]) => `${column}:${value}`).join(",")]] : [];
  }));

  const button = (text, act) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", act);
    find("play-presets").append(made);
  };
  for (const one of channels) {
    Object.entries(one.sliders).forEach(([label, index]) => add(one, one.columns[index], label));
    one.presets.forEach(({ name, values: some }) => button(name, () => (
      panel.set(some.map(([index, value]) => [one, one.columns[index], value]), one))));
    if (columns(one).length) button(one.rest, () => panel.set([], one));
  }
  show();
  return panel;
};
