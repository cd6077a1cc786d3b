"use strict";
// Figures of a report's summary on a printed sheet, from a page or a file: a good deal smaller than on the screen. Texts
// shrink as far as they must to stand clear of each other, or are left out.

const TEXT = 8, LEAST = 6, TITLE = 11; // pixels, of texts
const CHARACTER = 0.52, DIGIT = 0.64, LINE = 1.2; // over the height of a text: width of either, and from line to line
const BESIDE_BARS = 0.6; // of a figure's width, for the names of bars
const BESIDE_MAP = { l: 50, r: 60 }; // pixels, for its steps and for the scale of its colours

const fitting = (text, room, most) => {
  const longest = Math.max(...text.split("<br>").map((line) => line.length));
  return Math.min(most, room / (CHARACTER * longest));
};

// What changes of a drawn figure of the summary, for Plotly.update: of its traces and of its layout.
function on_sheet(plot, { width, height, margin }) {
  const map = plot.data.find((trace) => trace.type === "heatmap");
  if (map) margin = { ...margin, ...BESIDE_MAP };
  const room = { x: width - margin.l - margin.r, y: height - margin.t - margin.b };
  const layout = { autosize: false, width, height, margin, "font.size": TEXT };
  const { title } = plot.layout;
  if (title?.text) layout["title.font.size"] = fitting(title.text, 0.92 * width, TITLE);
  const names = Object.keys(plot.layout).filter((name) => /^[xy]axis/.test(name));
  const panels = names.filter((name) => name.startsWith("y")).length;
  for (const name of names) {
    const { domain = [0, 1], title, type, range } = plot.layout[name];
    const length = room[name[0]] * (domain[1] - domain[0]);
    layout[`${name}.title.font.size`] = title?.text ? fitting(title.text, length, TEXT + 1) : TEXT;
    if (name.startsWith("x") || panels === 1) continue;
    if (type === "log") layout[`${name}.dtick`] = (Math.log10(2) * length) / (range[1] - range[0]) < TEXT ? 1 : "D2";
    else layout[`${name}.nticks`] = Math.max(4, Math.floor(length / (2 * TEXT)));
  }
  const [first] = plot.data;
  if (first.orientation === "h") return [bars_on_sheet(first, width, room, layout), layout];
  return [map ? map_on_sheet(plot, map, room, layout) : {}, layout];
}

// Of bars the names beside them, in as many lines as a bar's share of the height has room for.
function bars_on_sheet(bars, width, room, layout) {
  const each = room.y / bars.y.length;
  const lines = Math.max(1, Math.floor(each / (LINE * LEAST)));
  const names = bars.y.map((name) => {
    const parts = name.replaceAll("<br>", " ").split(" + ");
    const shared = Math.ceil(parts.length / lines);
    const starts = parts.flatMap((_, place) => (place % shared === 0 ? [place] : []));
    return starts.map((start) => parts.slice(start, start + shared).join(" + ")).join(" +<br>");
  });
  const most = Math.max(...names.map((name) => name.split("<br>").length));
  const sizes = names.map((name) => fitting(name, BESIDE_BARS * width, Math.min(TEXT, each / (LINE * most))));
  layout["yaxis.tickfont.size"] = Math.min(...sizes);
  return { y: [names] };
}

// Of a map also the numbers of its cells, the names of its steps, as many as have room, and the scale of its colours.
function map_on_sheet(plot, map, room, layout) {
  const steps = { x: plot.layout.xaxis.ticktext.length, y: plot.layout.yaxis.ticktext.length };
  for (const axis of ["x", "y"]) {
    const every = Math.ceil((LINE * TEXT * steps[axis]) / room[axis]);
    const kept = (_, place) => place % every === 0;
    layout[`${axis}axis.tickvals`] = plot.layout[`${axis}axis`].tickvals.filter(kept);
    layout[`${axis}axis.ticktext`] = plot.layout[`${axis}axis`].ticktext.filter(kept);
  }
  const widest = Math.max(...plot.layout.xaxis.ticktext.map((text) => text.length)) + 1;
  layout["xaxis.tickangle"] = DIGIT * TEXT * widest < room.x / steps.x ? 0 : 90;
  const scale = { "colorbar.thickness": 8, "colorbar.xpad": 3, "colorbar.tickfont.size": 7, "colorbar.title.font.size": TEXT };
  if (!map.texttemplate) return scale;
  const longest = Math.max(...map.text.flat().map((text) => text.length));
  const size = Math.min(TEXT, room.x / steps.x / (DIGIT * (longest + 0.8)), room.y / steps.y / LINE);
  return { ...scale, ...(size < LEAST ? { texttemplate: "" } : { "textfont.size": size }) };
}
