// Drawing at most so often, and on a slow computer less often: the page's buttons come first.
const SHARE = 4, FRAME_MS = 17, LONGEST_MS = 1000;

// A function that asks for a drawing. A drawing that came late by some time is followed by a pause four times as long.
export function paced(draw, pause_ms) {
  let due = false, pause = pause_ms;
  return () => {
    if (due) return;
    due = true;
    const asked = performance.now();
    setTimeout(() => requestAnimationFrame(() => {
      due = false;
      const late = performance.now() - asked - pause;
      pause = Math.min(Math.max(pause_ms, SHARE * (late - FRAME_MS)), LONGEST_MS);
      draw();
    }), pause);
  };
}
