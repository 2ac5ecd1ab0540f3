// The emergency stop: both servers at once, whatever else the page does. Without this script the form does it alone.
import { token } from "./link.js";

const form = document.getElementById("stop-form");

export function emergencyStop() {
  const body = new URLSearchParams({ token });
  const own = fetch(document.body.dataset.stop, { method: "POST", mode: "no-cors", body, keepalive: true });
  const beside = fetch("/stop", { method: "POST", headers: { "X-Tubefoot-Token": token }, keepalive: true })
    .then((answer) => { if (!answer.ok) throw new Error(answer.statusText); });
  Promise.any([own, beside]).catch(() => form.submit());
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  emergencyStop();
});
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || event.repeat) return;
  event.preventDefault();
  emergencyStop();
}, { capture: true });
