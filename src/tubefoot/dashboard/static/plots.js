// Angle and pressures of the last half minute.
import uPlot from "/vendored/uplot/uPlot.esm.js";
import { paced } from "./pace.js";
import { ANGLES, SAMPLES } from "./wire.js";

const WINDOW_S = 30, HEIGHT = 190, DRAW_MS = 50;
const css = getComputedStyle(document.documentElement);
const colour = (name) => css.getPropertyValue(`--${name}`).trim();
const angles = [[], [], []], samples = [[], [], []];
const now = (name, text) => { document.getElementById(`now-${name}`).textContent = text; };

const anglePlot = plot("angle-plot", angles, "Angle [deg]", 10, [
  { label: "bend", stroke: colour("bend"), width: 2 },
  { label: "target", stroke: colour("target"), width: 1.5, dash: [6, 4] },
]);
const pressurePlot = plot("pressure-plot", samples, "Pressure [kPa]", 10, [
  { label: "right", stroke: colour("right"), width: 2 },
  { label: "left", stroke: colour("left"), width: 2, dash: [8, 3] },
]);
const drawSoon = paced(redraw, DRAW_MS);

function plot(id, data, label, least, series) {
  const place = document.getElementById(id);
  const value = (_, number) => (number == null ? "–" : number.toFixed(2));
  const made = new uPlot({
    width: place.clientWidth || 600, height: HEIGHT,
    legend: { live: false },
    cursor: { sync: { key: "time" } },
    scales: { x: { time: false }, y: { range: (_, low, high) => around(low, high, least) } },
    series: [{ label: "time [s]" },
      ...series.map((line) => ({ spanGaps: false, value, points: { show: false }, ...line }))],
    axes: [{ size: 36, values: (_, ticks) => ticks.map((tick) => (tick ? `${tick} s`.replace("-", "−") : "now")), font: "12px sans-serif", stroke: colour("quiet"), grid: { stroke: "#e4e8ee" } },
      { label, size: 52, labelSize: 18, font: "12px sans-serif", labelFont: "12px sans-serif", stroke: colour("quiet"),
        grid: { stroke: "#e4e8ee" } }],
  }, data, place);
  new ResizeObserver(() => made.setSize({ width: place.clientWidth, height: HEIGHT })).observe(place);
  return made;
}

// A range that does not twitch: at least so wide, widened in whole steps.
function around(low, high, least) {
  if (low == null || high == null) return [-least, least];
  const step = least / 2;
  return [Math.min(-step, Math.floor(low / step - 0.2) * step), Math.max(step, Math.ceil(high / step + 0.2) * step)];
}

export function showRows(news) {
  for (const row of news[ANGLES] ?? []) add(angles, [row[0], finite(row[1]), finite(row[2])]);
  for (const row of news[SAMPLES] ?? []) add(samples, [row[0], row[1], row[2]]);
  const angle = news[ANGLES]?.at(-1), sample = news[SAMPLES]?.at(-1);
  if (angle) {
    now("bend", number(angle[1]));
    now("target", number(angle[2]));
  }
  if (sample) {
    now("right", number(sample[1]));
    now("left", number(sample[2]));
    now("volume", number(sample[3], 2));
    const pump = ["into left", "stands", "into right"][sample[4] + 1] ?? "–";
    now("pump", pump);
    document.getElementById("stopped-pump").textContent = pump;
  }
  if (angle || sample) drawSoon();
}

function redraw() {
  const newest = Math.max(angles[0].at(-1) ?? 0, samples[0].at(-1) ?? 0);
  for (const [chart, data] of [[anglePlot, angles], [pressurePlot, samples]]) {
    trim(data, newest - WINDOW_S);
    chart.batch(() => {
      chart.setData([data[0].map((time) => time - newest), ...data.slice(1)], false);
      chart.setScale("x", { min: -WINDOW_S, max: 0 });
      chart.setScale("y", { min: null, max: null });
    });
  }
}

function add(data, row) {
  const last = data[0].at(-1);
  if (last !== undefined && row[0] < last) data.forEach((column) => { column.length = 0; });  // time jumped back
  if (last === row[0]) return;
  row.forEach((value, column) => data[column].push(value));
}

function trim(data, oldest) {
  const gone = data[0].findIndex((time) => time >= oldest);
  if (gone > 50) data.forEach((column) => column.splice(0, gone));
}

const finite = (value) => (Number.isFinite(value) ? value : null);
const number = (value, digits = 1) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
