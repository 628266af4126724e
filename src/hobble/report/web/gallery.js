// The gallery: a card for each limp or manner that the character can walk. The figure on a card walks while the pointer or the focus is on it.
import { createActor, createTicker } from "./actor.js";
import { find, valueKey } from "./base.js";
import { createView } from "./view.js";

const SETTLE = 150; // frames that a figure walks before its card shows it
const TARGET = { velocity: [0, 2.5], facing: null, gait: "walk" };

// The walks of a channel: {name, values: [column, value] pairs}. Presets come first, then each slider at 8 tenths of the highest value.
const walksOf = (channel) => [
  ...channel.presets.map(({ name, values }) => ({ name, values: values.map(([index, value]) => [channel.columns[index], value]) })),
  ...Object.entries(channel.sliders).map(([name, index]) => ({ name, values: [[channel.columns[index], .8 * channel.highest]] })),
];

const createCard = (spec, channel, { name, values }, chosen) => {
  const card = document.createElement("button"), canvas = document.createElement("canvas"), words = document.createElement("b");
  card.type = "button";
  words.textContent = name;
  card.append(canvas, words);
  card.addEventListener("click", () => chosen(channel, values));
  const hurt = new Map(values.map(([column, value]) => [valueKey(channel, column), value]));
  const ticker = createTicker();
  let actor = null, walks = false;
  const view = createView(canvas, { yaw: .62, pitch: .1, distance: 430 }, (now) => {
    if (!actor) {
      actor = createActor(view, spec);
      actor.start(() => 0);
      for (let f = 0; f < SETTLE; f++) actor.frame(TARGET, hurt);
    }
    for (let n = walks ? ticker.frames(now) : 0; n > 0; n--) actor.frame(TARGET, hurt);
    const [x, , z] = actor.character.root;
    view.aim([0, 84, 0]);
    view.land.drawAround([0, 0, 0]);
    actor.draw(null, [-x, -z]);
    view.land.darkenUnder(actor.figure.balls(view.balls));
    if (walks) view.requestDraw();
  }, { marks: 40 });
  view.framing = { size: 2.5, aside: 0, up: -.02 };
  const walk = (on) => { walks = on; ticker.rest(); view.requestDraw(); };
  for (const [event, on] of [["pointerenter", true], ["focus", true], ["pointerleave", false], ["blur", false]]) card.addEventListener(event, () => walk(on));
  return card;
};

// chosen(channel, values): called after a click on a card. values: [column, value] pairs.
export const startGallery = (spec, chosen) => {
  const cards = spec.channels.flatMap((channel) => walksOf(channel).map((walk) => createCard(spec, channel, walk, chosen)));
  find("gallery-cards").replaceChildren(...cards);
  find("gallery").hidden = !cards.length;
};
