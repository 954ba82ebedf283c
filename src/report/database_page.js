"use strict";
(() => {
  const find = (selector) => document.querySelector(selector);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const rows = all("tbody tr[data-id]");
  const card = new Map(all("article[data-id]").map((a) => [a.dataset.id, a]));
  const control = (name) => find("#" + name);
  const number = (name, open) => {
    const value = parseFloat(control(name).value.replace(",", "."));
    return Number.isFinite(value) ? value : open;
  };
  function filter() {
    const words = control("words").value.toLowerCase().split(/\s+/).filter(Boolean);
    const kind = control("kind").value;
    const origin = control("origin").value;
    const printable = control("printable").checked;
    const least = number("least", 0);
    const most = number("most", Infinity);
    let shown = 0;
    for (const row of rows) {
      const d = row.dataset;
      const young = Number(d.stiffness);
      const takes = words.every((word) => d.words.includes(word))
        && (!kind || d.kind === kind)
        && (!origin || d.origin === origin)
        && (!printable || d.printable === "true")
        && young >= least && young <= most;
      row.hidden = !takes;
      card.get(d.id).hidden = !takes;
      if (takes) shown += 1;
    }
    control("shown").textContent = shown + " of " + rows.length + " materials";
  }
  function sort(key, rising) {
    const value = (row) => row.dataset[key];
    const numbers = key !== "id";
    const order = (a, b) => numbers ? Number(value(a)) - Number(value(b)) : value(a).localeCompare(value(b));
    rows.sort((a, b) => (rising ? 1 : -1) * order(a, b));
    for (const row of rows) {
      row.parentNode.appendChild(row);
      const place = card.get(row.dataset.id);
      place.parentNode.appendChild(place);
    }
  }
  for (const head of all("th[data-sort]")) {
    head.querySelector("button").addEventListener("click", () => {
      const rising = head.getAttribute("aria-sort") !== "ascending";
      for (const other of all("th[data-sort]")) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", rising ? "ascending" : "descending");
      sort(head.dataset.sort, rising);
    });
  }
  find("form").addEventListener("input", filter);
  find("form").addEventListener("submit", (event) => event.preventDefault());
  find("form").addEventListener("reset", () => setTimeout(filter));
  find("form").hidden = false;
  filter();
})();
