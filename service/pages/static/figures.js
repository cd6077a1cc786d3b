"use strict";
// Draws the figures of a page, one at a time and as they come into view, so that the page never stands still.

const CONFIG = { displaylogo: false, responsive: true, displayModeBar: false };

function document_of(plot) {
  const figure = JSON.parse(plot.parentElement.querySelector('script[type="application/json"]').textContent);
  return in_zone(as_chosen(figure, plot.parentElement.querySelector("[data-choice]")));
}

// What the figure's own menu would do, which only a pointer can open; a list of the page stands in its place.
function as_chosen(figure, list) {
  if (!list) return figure;
  const [changed, layout] = figure.layout.updatemenus[0].buttons[list.value].args;
  for (const [name, values] of Object.entries(changed)) {
    figure.data.forEach((trace, index) => (trace[name] = values[index]));
  }
  for (const [path, value] of Object.entries(layout)) {
    const keys = path.split(".");
    const last = keys.pop();
    keys.reduce((part, key) => (part[key] ??= {}), figure.layout)[last] = value;
  }
  delete figure.layout.updatemenus;
  return figure;
}

// Times come in UTC, and plotly draws them as they are written: written here as the viewer's clocks show them.
function in_zone(figure) {
  const axis = figure.layout.xaxis;
  if (axis?.type !== "date") return figure;
  for (const trace of figure.data) {
    trace.x = trace.x.map((time) => {
      const when = new Date(time);
      return new Date(when - 60_000 * when.getTimezoneOffset()).toISOString().slice(0, -1);
    });
    trace.hovertemplate = trace.hovertemplate?.replaceAll(" UTC", "");
  }
  axis.title.text += ` (times of ${Intl.DateTimeFormat().resolvedOptions().timeZone})`;
  return figure;
}

async function draw(plot) {
  if (plot.dataset.drawn) return;
  plot.dataset.drawn = "yes";
  await redraw(plot);
  plot.on("plotly_click", ({ points: [point] }) => choose_sensor(sensor_of(point)));
  plot.on("plotly_hover", ({ points: [point] }) => point_at(sensor_of(point)));
}

// Its id where points are sensors, else what it holds beside its place: ids must differ within a figure.
const sensor_of = (point) => point.id ?? point.customdata;

// A sensor that is clicked in any figure is the one that the page's list would choose.
function choose_sensor(id) {
  const list = document.querySelector("[data-sensors]");
  if (id === undefined || ![...(list?.options ?? [])].some((option) => option.value === id)) return;
  list.value = id;
  submit(list);
}

// A sensor that is pointed at in any figure gets its line, where a figure shows many.
function point_at(id) {
  for (const plot of document.querySelectorAll(".plot[data-drawn]")) {
    const line = plot.data?.findIndex((trace) => trace.name === "pointed at");
    if (id === undefined || !(line > -1) || plot.dataset.pointed === id) continue;
    plot.dataset.pointed = id;
    const every = plot.data.find((trace) => trace.name === "every sensor");
    const own = every.customdata.flatMap((name, index) => (name === id ? [index] : []));
    const column = (name) => [own.map((index) => every[name][index])];
    Plotly.restyle(plot, { x: column("x"), y: column("y"), customdata: [own.map(() => id)], text: column("text") }, [line]);
  }
}

// Where a figure is narrow its legend has a line an entry, of a long name several, which panels one above the other
// have no room for, and which may be as wide as the figure. Returns how many lines.
const TOP = 30, OF_TITLE = 60; // pixels above a figure, and those of its title, which stands in the caption instead
const RIGHT = 20;
function in_legend(data, layout, margin) {
  if (!layout.yaxis2 || layout.yaxis2.matches || layout.showlegend === false) return 0;
  margin.r = Math.min(margin.r ?? RIGHT, RIGHT);
  const entries = data.filter((trace) => trace.showlegend !== false && trace.visible !== false);
  for (const trace of entries) trace.name = in_lines(trace.name ?? "");
  const titles = Object.entries(layout).flatMap(([name, axis]) => (name.startsWith("xaxis") ? [axis.title ?? {}] : []));
  for (const title of titles) title.text = in_lines(title.text ?? "");
  return entries.flatMap((trace) => trace.name.split("<br>")).length;
}

// With the JSON as it is now, in the reader's colours.
async function redraw(plot) {
  const { data, layout } = document_of(plot);
  paint(colours_of({ data, layout }));
  dim_map(data, layout);
  const top = Math.max(TOP, (layout.margin?.t ?? 0) - OF_TITLE);
  const margin = { ...layout.template?.layout?.margin, ...layout.margin, t: top };
  const with_legend = layout.height + (plot.clientWidth < NARROW ? LEGEND_LINE * in_legend(data, layout, margin) : 0);
  const height = fit_map(plot, data, layout, margin, with_legend);
  plot.style.minHeight = `${height}px`;
  // The caption above says the title.
  await Plotly.react(plot, data, { ...layout, title: undefined, height, margin, autosize: true }, CONFIG);
  plot.dispatchEvent(new CustomEvent("drawn", { bubbles: true }));
}

let queue = Promise.resolve();
function soon(plot) {
  queue = queue.then(() => new Promise((done) => setTimeout(done))).then(() => draw(plot));
}

const seen = new IntersectionObserver(
  (entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) {
        seen.unobserve(entry.target);
        soon(entry.target);
      }
    }
  },
  { rootMargin: "400px" },
);
// On paper a figure is as wide as the sheet, whatever the window's width is; those of a report's summary share a sheet
// with its text, and what is folded below it is unfolded.
const SHEET = 680;
DARK.addEventListener("change", () => document.querySelectorAll(".plot[data-drawn]").forEach(redraw));
let unfolded = [];
function in_summary(plot, place) {
  const long = document.querySelector(".report .summary.long") !== null;
  const height = place ? (long ? 145 : 190) : (long ? 260 : 340) + (plot.closest("#figure-curve") ? 50 : 0);
  const margin = { l: 70, r: place ? 50 : 20, t: 10, b: 55 };
  return on_sheet(plot, { width: place ? SHEET / 2 - 5 : SHEET, height, margin });
}
addEventListener("beforeprint", () => {
  unfolded = [...document.querySelectorAll(".report details:not([open])")];
  for (const part of unfolded) part.open = true;
  const summary = [...document.querySelectorAll(".three .plot")];
  for (const plot of document.querySelectorAll(".plot")) {
    if (DARK.matches && plot.dataset.drawn) redraw(plot);
    else draw(plot);
    const place = summary.indexOf(plot);
    if (place < 0) Plotly.relayout(plot, { autosize: false, width: Math.min(SHEET, plot.clientWidth) });
    else Plotly.update(plot, ...in_summary(plot, place));
  }
});
addEventListener("afterprint", () => {
  for (const part of unfolded) part.open = false;
  for (const plot of document.querySelectorAll(".plot")) {
    if (DARK.matches || plot.closest(".three")) redraw(plot);
    else Plotly.relayout(plot, { autosize: true, width: null });
  }
});

function prepare(root) {
  for (const plot of root.querySelectorAll(".plot")) {
    plot.style.minHeight = `${plot.dataset.height}px`;
    seen.observe(plot);
  }
  for (const list of root.querySelectorAll("[data-choice]")) choose(list);
  for (const button of root.querySelectorAll("[data-save]")) button.addEventListener("click", () => save(button));
}

// One after another, by the list, or by the buttons beside it.
function choose(list) {
  const figure = list.closest("figure");
  const steps = [...figure.querySelectorAll("[data-step]")];
  list.addEventListener("change", () => {
    for (const step of steps) step.disabled = !list.options[list.selectedIndex + Number(step.dataset.step)];
    redraw(figure.querySelector(".plot"));
  });
  for (const step of steps) {
    step.addEventListener("click", () => {
      list.selectedIndex += Number(step.dataset.step);
      list.dispatchEvent(new Event("change"));
    });
  }
}

async function save(button) {
  const plot = button.closest("figure").querySelector(".plot");
  const { data, layout } = document_of(plot);
  const size = { width: Math.max(plot.clientWidth, 640), height: Number(plot.dataset.height) + 30 };
  await Plotly.downloadImage({ data, layout: { ...layout, ...size } }, {
    format: button.dataset.save, filename: button.dataset.name, scale: button.dataset.save === "png" ? 2 : 1, ...size,
  });
}

prepare(document);
addEventListener("renewed", (event) => prepare(event.target));
