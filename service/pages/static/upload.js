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
