"use strict";
// Files dropped anywhere on the page are those of the form; while they are on their way the page says so.

const form = document.getElementById("upload");
if (form) {
  const files = form.elements.file;
  form.querySelector("[data-drop]").hidden = false;

  addEventListener("dragover", (event) => {
    event.preventDefault();
    form.classList.add("over");
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) form.classList.remove("over");
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    form.classList.remove("over");
    if (event.dataTransfer.files.length === 0) return;
    files.files = event.dataTransfer.files;
    form.requestSubmit();
  });
  form.addEventListener("submit", () => {
    const count = files.files.length;
    document.getElementById("reading").textContent = `Reading ${count === 1 ? files.files[0].name : `${count} files`} …`;
    form.querySelector("button").disabled = true;
  });
  addEventListener("pageshow", () => {
    form.querySelector("button").disabled = false;
    document.getElementById("reading").textContent = "";
  });
}

// The request that would do the same, with the files that were chosen.
function inShell(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'"'"'`)}'`;
}
if (form) {
  const codes = [...document.querySelectorAll(".same code")];
  const first = codes.map((code) => code.textContent);
  const named = (text, files, rig) => [
    text[0]
      .replace("-F file=@monday.tdms", () => files.map((name) => `-F ${inShell(`file=@${name}`)}`).join(" \\\n  "))
      .replace(" \\\n  -F rig=@rig.yaml", () => (rig ? ` \\\n  -F ${inShell(`rig=@${rig}`)}` : "")),
    text[1]
      .replace("['monday.tdms']", () => `[${files.map((name) => JSON.stringify(name)).join(", ")}]`)
      .replace(", rig='rig.yaml'", () => (rig ? `, rig=${JSON.stringify(rig)}` : "")),
  ];
  form.addEventListener("change", () => {
    const files = [...form.elements.file.files].map((file) => file.name);
    if (files.length === 0) return;
    named(first, files, form.elements.rig.files[0]?.name).forEach((text, index) => (codes[index].textContent = text));
  });
}

// Of the mapping, what the kind of recording has.
const kind = document.getElementById("kind");
function fit() {
  for (const entry of document.querySelectorAll("[data-kinds]")) {
    entry.hidden = !entry.dataset.kinds.split(" ").includes(kind.value);
  }
}
if (kind) {
  kind.addEventListener("change", fit);
  fit();
}

// What was changed in the mapping and not read yet is not kept.
function changed() {
  const keep = document.querySelector("form.keep .actions button:not(.second)");
  if (!keep || keep.disabled) return;
  keep.disabled = true;
  document.getElementById("keep-why-not").hidden = false;
}
document.querySelector("#mapping form")?.addEventListener("input", changed);

// Of a value that is typed or stated by the file, what was done last counts.
for (const entry of document.querySelectorAll(".either")) {
  const [typed, from] = [entry.querySelector("input"), entry.querySelector("select[name$='-from']")];
  if (!typed || !from) continue;
  typed.addEventListener("input", () => {
    if (typed.value !== "") from.value = "";
  });
  from.addEventListener("change", () => {
    if (from.value !== "") typed.value = "";
  });
}

// Dragging across the figure of the samples fills in which ones are used.
addEventListener("drawn", ({ target: plot }) => {
  if (plot.closest("figure")?.id !== "figure-course") return;
  plot.on("plotly_selected", (event) => {
    const range = event?.range && Object.entries(event.range).find(([axis]) => axis.startsWith("x"))?.[1];
    if (!range) return;
    const [first, last] = [...range].sort((one, other) => one - other);
    const fields = document.querySelectorAll("[data-trim]");
    fields[0].value = Math.max(1, Math.ceil(first));
    fields[1].value = Math.max(2, Math.floor(last));
    document.getElementById("mapping").open = true;
    changed();
    document.querySelector("[data-brushed]").textContent =
      `Samples ${fields[0].value} to ${fields[1].value} are filled in below: read it with these settings.`;
  });
});
