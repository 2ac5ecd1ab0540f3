// The camera's picture, and over it what was measured in this very picture.
import { LINE, LOST, OUTLINES, PICTURE } from "./wire.js";

const MARKER = "#00a86b", TIP = "#ffb000", CENTRELINE = "#d62fd6";
const picture = document.getElementById("picture"), overlay = document.getElementById("overlay");
// Painted by the processor: where there is no graphics card, its stand-in in software takes longer.
const PAINTED = { willReadFrequently: true };
const paper = picture.getContext("2d", PAINTED), film = overlay.getContext("2d", PAINTED);
const rate = document.getElementById("rate"), lost = document.getElementById("lost");
let busy = false, next = null, shown = 0, since = performance.now();

export const seen = { frames: 0, time: 0 };

export function showPicture(news) {
  if (LOST in news) lost.textContent = news[LOST] ? `tip lost: ${news[LOST]}` : "";
  if (!(PICTURE in news)) return;
  next = news;
  if (!busy) draw();
}

async function draw() {
  busy = true;
  while (next) {
    const news = next, head = news[PICTURE];
    next = null;
    try {
      const bitmap = await createImageBitmap(head.jpeg);
      if (picture.width !== head.width || picture.height !== head.height) {
        for (const canvas of [picture, overlay]) [canvas.width, canvas.height] = [head.width, head.height];
        document.querySelector(".stage").style.aspectRatio = `${head.width} / ${head.height}`;
      }
      paper.drawImage(bitmap, 0, 0);
      bitmap.close();
      drawOver(news);
      document.getElementById("no-picture").hidden = true;
      count(head.time);
    } catch (fault) {
      console.warn("a picture could not be decoded", fault);
    }
  }
  busy = false;
}

function drawOver(news) {
  film.clearRect(0, 0, overlay.width, overlay.height);
  film.lineWidth = 2;
  const { count, values } = news[OUTLINES];
  for (let marker = 0; marker < count; marker++) {
    film.strokeStyle = marker === count - 1 ? TIP : MARKER;
    path(values, marker * 8, 4);
    film.closePath();
    film.stroke();
  }
  if (news[LINE].count) {
    film.strokeStyle = CENTRELINE;
    path(news[LINE].values, 0, news[LINE].count);
    film.stroke();
  }
}

// A pixel's coordinates name its centre, a canvas counts from its corner: hence the half.
function path(values, from, points) {
  film.beginPath();
  for (let point = 0; point < points; point++) {
    film.lineTo(values[from + 2 * point] + 0.5, values[from + 2 * point + 1] + 0.5);
  }
}

function count(time) {
  seen.frames += 1;
  seen.time = time;
  shown += 1;
  const passed = performance.now() - since;
  if (passed < 1000) return;
  rate.textContent = `${(1000 * shown / passed).toFixed(0)} pictures/s`;
  shown = 0;
  since = performance.now();
}
