// Buttons into orders, the state in words onto the page.
import { order, page } from "./link.js";

const at = (id) => document.getElementById(id);
const state = { online: false };
let asked = 0;

export function showState(news) {
  Object.assign(state, news);
  at("bench-name").textContent = state.bench ? state.bench.name : "opening the bench";
  showHelm();
  showBanners();
  showOrder();
  showQuestion();
  showLog();
  showReplay();
}

export function showOnline(online) {
  state.online = online;
  at("link").textContent = online ? "live" : "reconnecting";
  at("link").classList.toggle("on", online);
  at("offline").hidden = online;
  showHelm();
}

function showHelm() {
  const mine = state.holder === page;
  at("helm").textContent = mine ? "You are in control"
    : state.holder ? "Another page is in control; this one watches" : "Nobody is in control";
  at("take").textContent = mine ? "Give control back" : "Take control";
  at("take").disabled = !state.online;
  const busy = state.phase === "running", free = mine && state.online && state.phase === "idle" && !state.stop?.tripped;
  for (const button of document.querySelectorAll("[data-free]")) button.disabled = !free;
  for (const button of document.querySelectorAll("[data-busy]")) button.disabled = !(mine && state.online && busy);
  for (const button of document.querySelectorAll("[data-held]")) button.disabled = !(mine && state.online);
  if (!state.bench?.camera) for (const id of ["start", "home"]) at(id).disabled = true;
  at("release").disabled = at("clear").disabled = !(mine && state.online);
}

function showBanners() {
  const stop = state.stop ?? {}, trouble = state.trouble ?? [];
  at("stopped").hidden = !stop.tripped;
  if (stop.tripped) at("stopped-text").textContent = `Asked for by the ${stop.who}: ${stop.answer}.`;
  at("trouble").hidden = !trouble.length;
  const words = JSON.stringify(trouble);
  if (at("trouble-list").dataset.words === words) return;  // a screen reader need not hear it again
  at("trouble-list").dataset.words = words;
  at("trouble-list").replaceChildren(...trouble.flatMap((one) => [made("dt", one.what), made("dd", one.advice)]));
}

function showOrder() {
  const running = state.phase === "running";
  at("order").classList.toggle("running", running);
  at("order").textContent = running ? `Running: ${state.order?.text}`
    : state.result ? `Idle. Last: ${state.result.text}` : "The bench is idle.";
  if (document.activeElement !== at("goes-on") && running) at("goes-on").checked = Boolean(state.goes_on);
  at("recording").textContent = state.recording ? `Recording into ${state.recording}` : "Nothing is being recorded.";
  at("record").textContent = state.recording ? "End recording" : "Start recording";
  at("progress").textContent = running ? state.progress ?? "" : "";
}

function showQuestion() {
  const question = state.question;
  at("question").hidden = !question || state.holder !== page;
  if (!question || question.id === asked) return;
  asked = question.id;
  at("question-text").textContent = question.text;
  at("answer").value = "";
  at("answer").hidden = at("answer-label").hidden = !question.number;
  if (state.holder === page) (question.number ? at("answer") : at("question").querySelector("button")).focus();
}

function showLog() {
  const lines = (state.notes ?? []).map((note) => {
    const line = made("li", note.text);
    line.className = note.level;
    const when = made("span", `${note.time_s.toFixed(1)} s`);
    when.className = "when";
    line.prepend(when);
    return line;
  });
  at("log").replaceChildren(...lines.reverse());
}

function showReplay() {
  const replay = state.replay;
  if (!replay) return;
  at("play").textContent = replay.playing ? "Pause" : "Play";
  at("seek").max = replay.length_s;
  if (document.activeElement !== at("seek")) at("seek").value = replay.at_s;
  at("place").textContent = `${replay.at_s.toFixed(1)} of ${replay.length_s.toFixed(1)} s`;
}

function made(kind, words) {
  const element = document.createElement(kind);
  element.textContent = words;
  return element;
}

async function send(message) {
  try {
    await order(message);
    at("refused").hidden = true;
  } catch (fault) {
    at("refused-text").textContent = fault.message;
    at("refused").hidden = false;
  }
}

function number(id) {
  const field = at(id);
  if (!field.reportValidity() || field.value === "") throw new Error(`${field.labels[0].textContent.trim()}: ${field.validationMessage || "a number is missing"}`);
  return Number(field.value);
}

async function fileText(id) {
  const [file] = at(id).files;
  return file ? file.text() : "";
}

async function start() {
  const controller = document.querySelector("input[name=controller]:checked").value, goes_on = at("goes-on").checked;
  if (controller !== "tracking") return send({ do: "bend", target_deg: number("target"), controller, goes_on });
  const table = await fileText("trajectory");
  const sine = { amplitude_deg: number("amplitude"), period_s: number("period"), cycles: number("cycles") };
  return send({ do: "follow", goes_on, ...sine, table });
}

const pulse = (direction) => send({ do: "pulse", direction, duty: number("duty"), duration_s: number("duration") });
const actions = {
  take: () => send({ do: state.holder === page ? "give_back" : "take" }),
  start, halt: () => send({ do: "stop" }), cancel: () => send({ do: "stop" }),
  home: () => send({ do: "bend", target_deg: 0, goes_on: at("goes-on").checked }),
  forward: () => pulse(1), reverse: () => pulse(-1), zero: () => send({ do: "zero" }), clear: () => send({ do: "clear" }),
  release: () => send({ do: "release" }),
  record: () => send(state.recording ? { do: "end_record" } : { do: "record", pictures: at("pictures").checked }),
  "play-campaign": async () => {
    const table = await fileText("campaign");
    if (!table) throw new Error("choose the campaign's file first");
    const form = at("campaign").files[0].name.toLowerCase().endsWith(".toml") ? "toml" : "csv";
    return send({ do: "play", table, form, pictures: at("pictures").checked });
  },
  play: () => send({ do: state.replay?.playing ? "pause" : "play" }),
  "refused-close": () => { at("refused").hidden = true; },
};

for (const [id, action] of Object.entries(actions)) {
  at(id).addEventListener("click", async () => {
    try {
      await action();
    } catch (fault) {
      at("refused-text").textContent = fault.message;
      at("refused").hidden = false;
    }
  });
}
for (const button of document.querySelectorAll("[data-calibrate]")) {
  button.addEventListener("click", () => send({ do: "calibrate", what: button.dataset.calibrate, goes_on: false }));
}
for (const choice of document.querySelectorAll("input[name=controller]")) {
  choice.addEventListener("change", () => {
    at("track-fields").hidden = choice.value !== "tracking";
    at("step-fields").hidden = choice.value === "tracking";
  });
}
at("goes-on").addEventListener("change", () => {
  if (state.phase === "running" && state.holder === page) send({ do: "keep_going", goes_on: at("goes-on").checked });
});
at("question").addEventListener("submit", (event) => {
  event.preventDefault();
  send({ do: "answer", id: asked, text: at("answer").value });
});
at("seek").addEventListener("change", () => send({ do: "seek", time_s: Number(at("seek").value) }));
at("speed").addEventListener("change", () => send({ do: "speed", factor: Number(at("speed").value) }));
