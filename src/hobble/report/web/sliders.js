// The channel values in Play. Each column of each channel has a value. Users set values with sliders, presets and keys.
import { find } from "./base.js";

// The key of a column in the Map of values.
export const valueKey = (channel, column) => `${channel.name}/${column}`;
// The channel whose columns stand for parts of the body; undefined if there is none.
export const bodyChannel = (spec) => spec.channels.find((channel) => channel.regions.length);
// The channel that the top of the page shows. It is one with parts of the body and a slider, or else the first one with a slider.
export const firstShown = (spec) => {
  const some = spec.channels.filter((channel) => Object.keys(channel.sliders).length);
  return some.find((channel) => channel.regions.length) || some[0];
};

// specs: data of the played characters, which may have different channels. changed(): called after every change.
export const createSliders = (specs, changed) => {
  const channels = [];
  // Of channels with the same name, the one with most trained columns is taken.
  for (const channel of specs.flatMap((spec) => spec.channels)) {
    const at = channels.findIndex(({ name }) => name === channel.name);
    if (at < 0) channels.push(channel);
    else if (channel.trained.length > channels[at].trained.length) channels[at] = channel;
  }
  // The trained columns of a channel in all characters. Other columns were always 0 in training and have no effect, so they are left out.
  const trainedColumns = (name) => specs.flatMap((spec) => spec.channels.filter((channel) => channel.name === name).flatMap((channel) => channel.trained));
  const values = new Map(channels.flatMap((channel) => trainedColumns(channel.name).map((column) => [valueKey(channel, column), 0])));
  const rows = [], panel = { values, channels }, columns = (channel) => [...new Set(trainedColumns(channel.name))];
  // The words for a column.
  panel.word = ({ name }, column) => specs.flatMap((spec) => spec.channels.filter((channel) => channel.name === name))
    .map((channel) => channel.spoken[channel.columns.indexOf(column)]).find(Boolean) || column;
  panel.say = (text) => { const note = find("play-note"); if (note) note.textContent = text; };

  const addSlider = (channel, column, label) => {
    const row = document.createElement("label"), name = document.createElement("span");
    const input = document.createElement("input"), output = document.createElement("output"), number = rows.length + 1;
    name.textContent = label;
    if (number < 10) {
      const key = document.createElement("kbd");
      key.textContent = number;
      name.append(" ", key);
    }
    Object.assign(input, { type: "range", min: 0, max: channel.highest, step: channel.sliderStep, value: 0 });
    input.dataset.channel = channel.name;
    input.addEventListener("input", () => { values.set(valueKey(channel, column), Number(input.value)); showValues(); });
    row.append(name, input, output);
    find("play-sliders").append(row);
    rows.push({ input, output, channel, column });
  };
  const hasSlider = (channel, column) => rows.some((row) => row.channel.name === channel.name && row.column === column);
  const setValue = (channel, column, value) => {
    if (!hasSlider(channel, column)) addSlider(channel, column, panel.word(channel, column));
    values.set(valueKey(channel, column), Math.min(channel.highest, Math.max(0, value)));
  };
  const showValues = () => {
    panel.say("");
    rows.forEach(({ input, output, channel, column }) => {
      const value = values.get(valueKey(channel, column));
      input.value = value;
      output.value = channel.highest < 5 ? value.toFixed(2) : value;
    });
    changed();
  };
  // Sets columns to values, and other columns to 0. triples: [channel, column, value]. only: if it is a channel, other channels stay as they are.
  panel.set = (triples, only = null) => {
    channels.filter((channel) => !only || channel === only).forEach((channel) => columns(channel).forEach((column) => values.set(valueKey(channel, column), 0)));
    triples.forEach(([channel, column, value]) => { if (values.has(valueKey(channel, column)) && value) setValue(channel, column, value); });
    showValues();
  };
  // Changes a value by a fifth of the highest value, after a click or a key. by: 1 or -1.
  panel.change = (channel, column, by) => {
    if (!values.has(valueKey(channel, column))) return;
    setValue(channel, column, Math.round(1e6 * (values.get(valueKey(channel, column)) + by * channel.highest / 5)) / 1e6);
    showValues();
  };
  // Changes the value of a slider after one of the keys 1 to 9. Returns whether the key has a slider.
  panel.key = (event) => {
    const digit = event.code.match(/^Digit([1-9])$/), slider = digit && rows[digit[1] - 1];
    if (slider) panel.change(slider.channel, slider.column, event.shiftKey ? -1 : 1);
    return Boolean(slider);
  };
  // The values for a link, with an entry for each channel that has values above 0: its key -> "column:value,column:value".
  panel.state = () => Object.fromEntries(channels.flatMap((channel) => {
    const some = columns(channel).map((column) => [column, values.get(valueKey(channel, column))]).filter(([, value]) => value > 0);
    return some.length ? [[channel.key, some.map(([column, value]) => `${column}:${value}`).join(",")]] : [];
  }));

  const addButton = (text, onClick) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.addEventListener("click", onClick);
    find("play-presets").append(made);
  };
  for (const channel of channels) {
    Object.entries(channel.sliders).forEach(([label, index]) => addSlider(channel, channel.columns[index], label));
    channel.presets.forEach(({ name, values: some }) => addButton(name, () => (
      panel.set(some.map(([index, value]) => [channel, channel.columns[index], value]), channel))));
    if (columns(channel).length) addButton(channel.rest, () => panel.set([], channel));
  }
  showValues();
  return panel;
};
