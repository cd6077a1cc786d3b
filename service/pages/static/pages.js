"use strict";
// Small helps on every page; each works without as well.

const DAY = { year: "numeric", month: "short", day: "numeric" };

// Times in the viewer's zone, the exact one under the pointer; in choices, which hold text alone, the day.
function show_times(root) {
  for (const time of root.querySelectorAll("time[datetime]")) {
    const when = new Date(time.dateTime);
    if (Number.isNaN(when.getTime())) continue;
    const { form } = time.dataset; // a day is the lab's, whatever the viewer's zone
    const clock = form === "day" ? { timeZone: "UTC" } : form === "date" ? {} : { hour: "2-digit", minute: "2-digit" };
    time.title = time.dateTime;
    time.textContent = when.toLocaleString(undefined, { ...DAY, ...clock });
  }
  for (const choice of root.querySelectorAll("option[data-day]")) {
    const day = new Date(choice.dataset.day).toLocaleDateString(undefined, { ...DAY, timeZone: "UTC" });
    choice.textContent = choice.textContent.replace(choice.dataset.day, day);
  }
}

// A choice with the pointer takes effect at once; who walks through the choices with keys presses the button. What is
// chosen empty does not stand in the address.
const leave_out_empty = (form) => {
  for (const field of form.elements) {
    if ("emptyLeftOut" in field.dataset && field.value === "") field.disabled = true;
  }
};
for (const form of document.querySelectorAll("form.request")) {
  form.addEventListener("submit", () => leave_out_empty(form));
}
addEventListener("pageshow", () => document.querySelectorAll("form.request :disabled").forEach((field) => (field.disabled = false)));
function submit(choice) {
  const form = choice.form;
  leave_out_empty(form);
  sessionStorage.setItem("chosen", choice.id);
  form.submit();
}
// Who chose is where he was, on the page that his choice made.
const chosen = sessionStorage.getItem("chosen");
if (chosen) {
  sessionStorage.removeItem("chosen");
  document.getElementById(chosen)?.focus({ preventScroll: true });
}
function submit_choices(root) {
  for (const choice of root.querySelectorAll("[data-submit]")) {
    let byKeys = false;
    choice.addEventListener("keydown", () => (byKeys = true));
    choice.addEventListener("pointerdown", () => (byKeys = false));
    choice.addEventListener("change", () => byKeys || submit(choice));
    choice.form.addEventListener("submit", (event) => {
      event.preventDefault();
      submit(choice);
    });
  }
}

// Also of a part that a script has renewed.
for (const help of [show_times, submit_choices]) {
  help(document);
  addEventListener("renewed", (event) => help(event.target));
}

// A search keeps what is ticked and typed in the form whose list it searches.
for (const search of document.querySelectorAll("[data-with]")) {
  search.addEventListener("formdata", ({ formData }) => {
    const form = document.getElementById(search.dataset.with);
    for (const box of form?.querySelectorAll(":checked") ?? []) formData.append("chosen", box.value);
    const name = form?.elements.name?.value;
    if (name) formData.append("name", name);
  });
}

// What was typed into a form that was sent after its session had ended stands in it again after the login. It waits in
// the tab's own storage, until the next page says whether it was taken.
const here = () => location.pathname + location.search;
const fields_of = (form) => [...form.elements].filter(({ name, type }) => name && !["hidden", "file", "password", "submit", "button"].includes(type));
addEventListener("submit", ({ target: form }) => {
  if (form.method !== "post" || location.pathname === "/login") return;
  const values = fields_of(form).map(({ name, type, value, checked }) => [name, /checkbox|radio/.test(type) ? checked : value]);
  sessionStorage.setItem("sent", JSON.stringify({ page: here(), form: [...document.forms].indexOf(form), values }));
});
function typed_again({ page, form, values }) {
  if (page !== here()) return;
  sessionStorage.removeItem("unsent");
  const fields = fields_of(document.forms[form] ?? document.createElement("form"));
  values.forEach(([name, value], index) => {
    const field = fields[index];
    if (field?.name !== name || "submit" in field.dataset) return;
    field[typeof value === "boolean" ? "checked" : "value"] = value;
    field.dispatchEvent(new Event("change", { bubbles: true }));
    field.closest("details")?.setAttribute("open", "");
  });
}
const sent = sessionStorage.getItem("sent");
sessionStorage.removeItem("sent");
if (sent && document.querySelector("[data-unsent]")) sessionStorage.setItem("unsent", sent);
const unsent = sessionStorage.getItem("unsent");
if (unsent && location.pathname !== "/login") addEventListener("load", () => typed_again(JSON.parse(unsent)));

for (const button of document.querySelectorAll("[data-copy]")) {
  button.addEventListener("click", async () => {
    const text = button.closest(".code").querySelector("code").textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const range = document.createRange(); // without a secure connection there is no clipboard: select it
      range.selectNodeContents(button.closest(".code").querySelector("code"));
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      document.execCommand("copy");
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
}

for (const button of document.querySelectorAll("[data-print]")) {
  button.hidden = false;
  button.addEventListener("click", () => print());
}
