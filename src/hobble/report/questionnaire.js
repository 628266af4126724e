// The questionnaire shows films in a random order, asks some questions about each film, and saves the answers as a file.
"use strict";
(() => {
  // study: the study's name. questions: key of an answer -> [question, choices]. parts: names of parts of the body.
  // films: {film: its name, webp: the film in base64}.
  const { study, questions, parts, films } = JSON.parse(document.getElementById("study").textContent);
  const find = (id) => document.getElementById(id), NOTHING = "nothing";
  const KEY = `hobble-study-${study}`;
  // state: {study, person, begun, order: names of the films, answers}, or null before the start. plays: how often the present film was played.
  let state = null, plays = 0, url = null;

  // If the browser allows local storage, a reopened page continues with the next film.
  const savedState = () => { try { return JSON.parse(localStorage.getItem(KEY)); } catch { return null; } };
  const saveState = () => { try { localStorage.setItem(KEY, JSON.stringify(state)); } catch { /* no local storage: a reopened page starts again */ } };

  const randomOrder = () => { // Fisher-Yates shuffle. Numbers from `limit` on are drawn again, so that all remainders are equally likely.
    const order = films.map(({ film }) => film), one = new Uint32Array(1);
    for (let i = order.length - 1; i > 0; i--) {
      const limit = Math.floor(2 ** 32 / (i + 1)) * (i + 1);
      do crypto.getRandomValues(one); while (one[0] >= limit);
      const j = one[0] % (i + 1);
      [order[i], order[j]] = [order[j], order[i]];
    }
    return order;
  };
  const addOption = (host, type, name, value, text) => {
    const label = document.createElement("label"), input = document.createElement("input");
    Object.assign(input, { type, name, value });
    label.append(input, text);
    host.append(label);
    return input;
  };
  const partBoxes = parts.map((part) => addOption(find("parts"), "checkbox", "part", part, part));
  const nothingBox = addOption(find("parts"), "checkbox", "part", NOTHING, "none of these");
  for (const [key, [question, choices]] of Object.entries(questions)) {
    const group = document.createElement("fieldset"), legend = document.createElement("legend"), marks = document.createElement("div");
    legend.textContent = question;
    marks.className = "marks";
    choices.forEach((choice) => addOption(marks, "radio", key, choice, choice));
    group.append(legend, marks);
    find("questions-asked").append(group);
  }
  const chosen = (key) => document.querySelector(`#questions-asked input[name="${key}"]:checked`)?.value;
  const tickedParts = () => partBoxes.filter((box) => box.checked).map((box) => box.value);

  const playFilm = () => {
    const { webp } = films.find(({ film }) => film === state.order[state.answers.length]);
    const raw = atob(webp), data = Uint8Array.from(raw, (c) => c.charCodeAt(0));
    if (url) URL.revokeObjectURL(url);
    url = URL.createObjectURL(new Blob([data], { type: "image/webp" })); // a new address restarts the film
    find("film").src = url;
    plays++;
  };
  const checkAnswers = () => {
    const open = Object.keys(questions).filter((key) => !chosen(key)).length, ticked = tickedParts().length > 0 || nothingBox.checked;
    find("next").disabled = open > 0 || !ticked;
    find("missing").textContent = open ? `Not answered yet: ${open + !ticked} of ${Object.keys(questions).length + 1} questions.`
      : ticked ? "" : "Tick the parts that are injured, or \"none of these\".";
  };
  const showSection = (name) => ["welcome", "asking", "done"].forEach((id) => { find(id).hidden = id !== name; });
  const askNext = () => {
    const number = state.answers.length;
    if (number === state.order.length) { finish(); return; }
    showSection("asking");
    find("progress").value = number;
    find("which").textContent = `Film ${number + 1} of ${state.order.length}`;
    find("questions").reset();
    plays = 0;
    checkAnswers();
    playFilm();
    find("which").focus({ preventScroll: true });
    scrollTo(0, 0);
  };
  const finish = () => {
    showSection("done");
    find("text").value = JSON.stringify(state, null, 1);
    find("thanks").focus();
  };

  find("questions").addEventListener("change", ({ target }) => {
    if (target === nothingBox && nothingBox.checked) partBoxes.forEach((box) => { box.checked = false; });
    else if (partBoxes.includes(target) && target.checked) nothingBox.checked = false;
    checkAnswers();
  });
  find("questions").addEventListener("submit", (event) => {
    event.preventDefault();
    const marks = Object.fromEntries(Object.keys(questions).map((key) => [key, chosen(key)]));
    state.answers.push({ film: state.order[state.answers.length], ...marks, parts: tickedParts(), plays });
    saveState();
    askNext();
  });
  find("again").addEventListener("click", playFilm);
  find("begin").addEventListener("click", () => {
    state ??= { study, person: find("person").value.trim(), begun: new Date().toISOString(), order: randomOrder(), answers: [] };
    saveState();
    askNext();
  });
  find("save").addEventListener("click", () => {
    const link = document.createElement("a"), file = URL.createObjectURL(new Blob([find("text").value], { type: "application/json" }));
    const who = state.person.replace(/[^A-Za-z0-9_-]+/g, "-") || state.begun.replace(/[^0-9]/g, "").slice(0, 14);
    Object.assign(link, { href: file, download: `answers-${who}.json` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(file), 1000);
  });

  const saved = savedState();
  if (saved?.study === study && Array.isArray(saved.answers) && saved.order?.length === films.length) {
    state = saved;
    find("person").value = state.person;
    find("resumed").textContent = `You have answered ${state.answers.length} of ${films.length} films. Press Begin to continue with the next one.`;
  }
  globalThis.Study = { films, get state() { return state; } };
})();
