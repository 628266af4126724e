// The questionnaire: films in a random order, two questions for each film, and a file with the answers.
"use strict";
(() => {
  const { study, parts, films } = JSON.parse(document.getElementById("study").textContent);
  const find = (id) => document.getElementById(id), NOTHING = "nothing", MARKS = { 1: "1, jerky", 2: "2", 3: "3", 4: "4", 5: "5, fluid" };
  const KEY = `hobble-study-${study}`;
  let state = null, plays = 0, url = null;

  // If the browser allows local storage, a reopened page continues with the next film.
  const kept = () => { try { return JSON.parse(localStorage.getItem(KEY)); } catch { return null; } };
  const keep = () => { try { localStorage.setItem(KEY, JSON.stringify(state)); } catch { /* no local storage: a reopened page starts again */ } };

  const randomOrder = () => { // Fisher-Yates shuffle; rejecting large values avoids modulo bias
    const order = films.map(({ film }) => film), one = new Uint32Array(1);
    for (let i = order.length - 1; i > 0; i--) {
      const most = Math.floor(2 ** 32 / (i + 1)) * (i + 1);
      do crypto.getRandomValues(one); while (one[0] >= most);
      const j = one[0] % (i + 1);
      [order[i], order[j]] = [order[j], order[i]];
    }
    return order;
  };
  const option = (host, type, name, value, text) => {
    const label = document.createElement("label"), input = document.createElement("input");
    Object.assign(input, { type, name, value });
    label.append(input, text);
    host.append(label);
    return input;
  };
  const boxes = parts.map((part) => option(find("parts"), "checkbox", "part", part, part));
  const none = option(find("parts"), "checkbox", "part", NOTHING, "nothing hurts");
  const marks = Object.entries(MARKS).map(([value, text]) => option(find("marks"), "radio", "fluid", value, text));
  const ticked = () => boxes.filter((box) => box.checked).map((box) => box.value);
  const fluid = () => Number(marks.find((mark) => mark.checked)?.value ?? 0);

  const play = () => {
    const { webp } = films.find(({ film }) => film === state.order[state.answers.length]);
    const raw = atob(webp), data = Uint8Array.from(raw, (c) => c.charCodeAt(0));
    if (url) URL.revokeObjectURL(url);
    url = URL.createObjectURL(new Blob([data], { type: "image/webp" })); // a new address restarts the film
    find("film").src = url;
    plays++;
  };
  const check = () => {
    const answered = ticked().length > 0 || none.checked, marked = fluid() > 0;
    find("next").disabled = !(answered && marked);
    find("missing").textContent = answered && marked ? "" : answered ? "Say how fluid the motion is." : marked ? "Tick the parts that hurt, or \"nothing hurts\"." : "";
  };
  const show = (name) => ["welcome", "asking", "done"].forEach((id) => { find(id).hidden = id !== name; });
  const ask = () => {
    const number = state.answers.length;
    if (number === state.order.length) { finish(); return; }
    show("asking");
    find("progress").value = number;
    find("which").textContent = `Film ${number + 1} of ${state.order.length}`;
    find("questions").reset();
    plays = 0;
    check();
    play();
    find("which").focus({ preventScroll: true });
    scrollTo(0, 0);
  };
  const finish = () => {
    show("done");
    find("text").value = JSON.stringify(state, null, 1);
    find("thanks").focus();
  };

  find("questions").addEventListener("change", ({ target }) => {
    if (target === none && none.checked) boxes.forEach((box) => { box.checked = false; });
    else if (boxes.includes(target) && target.checked) none.checked = false;
    check();
  });
  find("questions").addEventListener("submit", (event) => {
    event.preventDefault();
    state.answers.push({ film: state.order[state.answers.length], parts: ticked(), fluid: fluid(), plays });
    keep();
    ask();
  });
  find("again").addEventListener("click", play);
  find("begin").addEventListener("click", () => {
    state ??= { study, person: find("person").value.trim(), begun: new Date().toISOString(), order: randomOrder(), answers: [] };
    keep();
    ask();
  });
  find("save").addEventListener("click", () => {
    const link = document.createElement("a"), file = URL.createObjectURL(new Blob([find("text").value], { type: "application/json" }));
    const who = state.person.replace(/[^A-Za-z0-9_-]+/g, "-") || state.begun.replace(/[^0-9]/g, "").slice(0, 14);
    Object.assign(link, { href: file, download: `answers-${who}.json` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(file), 1000);
  });

  const before = kept();
  if (before?.study === study && Array.isArray(before.answers) && before.order?.length === films.length) {
    state = before;
    find("person").value = state.person;
    find("resumed").textContent = `You have answered ${state.answers.length} of ${films.length} films. Begin continues with the next one.`;
  }
  globalThis.Study = { films, get state() { return state; } };
})();
