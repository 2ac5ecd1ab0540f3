// The page's heart, a worker: beats on while the page's own thread is busy drawing, not while that hangs.
const BEAT_MS = 400, LOST_MS = 2000;
const HANG_MS = 10000;  // a page that does nothing for so long answers no click either
let page = null, alive = 0, beating = false;

onmessage = ({ data }) => {
  if (data) page = data;
  alive = performance.now();
};

async function beat() {
  if (!page || beating || performance.now() - alive > HANG_MS) return;
  beating = true;
  const headers = { "X-Tubefoot-Token": page.token, "X-Tubefoot-Page": page.name };
  await fetch("/api/beat", { method: "POST", headers, signal: AbortSignal.timeout(LOST_MS) }).catch(() => null);
  beating = false;
}

setInterval(beat, BEAT_MS);
