// The line to the program: one websocket that comes back by itself, orders by POST; the heart beats beside them.
import { unpacked } from "./wire.js";

const ALIVE_MS = 400, FIRST_WAIT_MS = 300, LONGEST_WAIT_MS = 2000;

export const token = document.body.dataset.token;
export const page = pageName();

function pageName() {
  const kept = sessionStorage.getItem("tubefoot-page");
  // a duplicated tab gets a copy of the storage: only a reload keeps the name
  const reloaded = performance.getEntriesByType("navigation")[0]?.type === "reload";
  if (kept && reloaded) return kept;
  const name = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) => byte.toString(16).padStart(2, "0")).join("");
  sessionStorage.setItem("tubefoot-page", name);
  return name;
}

export class Link {
  constructor(onNews, onState) {
    this.onNews = onNews;
    this.onState = onState;
    this.wait = FIRST_WAIT_MS;
    this.said = 0;
    this.heart = new Worker("/static/heart.js");
    this.heart.postMessage({ token, name: page });
    this.open();
    setInterval(() => this.live(), ALIVE_MS);
  }

  open() {
    const address = `ws://${location.host}/live?token=${encodeURIComponent(token)}&page=${page}`;
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { this.wait = FIRST_WAIT_MS; this.onState(true); };
    socket.onmessage = (event) => {
      this.onNews(unpacked(event.data));
      this.live();  // timers of a hidden page are slowed down, messages are not
    };
    socket.onclose = () => {
      this.onState(false);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(this.wait * 1.6, LONGEST_WAIT_MS);
    };
    this.socket = socket;
  }

  live() {
    const now = performance.now();
    if (this.socket.readyState !== WebSocket.OPEN || now - this.said < ALIVE_MS * 0.9) return;
    this.said = now;
    this.heart.postMessage(null);
  }
}

export async function order(message) {
  const answer = await fetch("/api/do", {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-Tubefoot-Token": token, "X-Tubefoot-Page": page },
    body: JSON.stringify(message),
  });
  const said = await answer.json();
  if (!answer.ok) throw new Error(said.error);
  return said;
}
