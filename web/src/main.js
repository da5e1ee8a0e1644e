// The page of a job: one choice of a part for space, drawings, sheets and tables.

import { load } from "./data.js";
import { Details } from "./details.js";
import { sortable } from "./tables.js";
import { setInches } from "./units.js";
import { Viewer } from "./viewer.js";

async function start() {
  const data = await load();
  const place = document.getElementById("viewer");
  const state = { part: null, seam: null };
  const wide = document.createElement("div");
  const beside = document.createElement("aside");
  place.append(wide, beside);
  beside.hidden = !data.parts.length;
  place.classList.toggle("alone", beside.hidden);

  function choosePart(panel, scroll = false) {
    chooseNumber(panel === null ? null : data.panels[panel].part, scroll);
  }

  function chooseNumber(number, scroll = false) {
    state.part = number;
    viewer?.mark(number);
    details.show(number);
    for (const one of document.querySelectorAll(".chosen")) one.classList.remove("chosen");
    if (number === null) chooseSeam(null);
    else
      for (const one of document.querySelectorAll(`:is(tr, figure, g)[data-part="${number}"]`)) one.classList.add("chosen");
    if (scroll) place.scrollIntoView({ block: "nearest" });
  }

  function chooseSeam(seam) {
    state.seam = seam;
    viewer?.markSeam(seam);
    for (const one of document.querySelectorAll(".marked")) one.classList.remove("marked");
    if (!seam) return;
    document.querySelector(`tr[data-seam="${seam.id}"]`)?.classList.add("marked");
    for (const panel of seam.panels)
      for (const figure of document.querySelectorAll(`figure.part[data-part="${data.panels[panel].part}"], .details`))
        for (const notch of figure.querySelectorAll(`.notch[data-mark="${seam.mark}"]`)) notch.classList.add("marked");
  }

  let viewer = null;
  try {
    if (data.panels.length) viewer = new Viewer(data, wide, (panel) => choosePart(panel), setInches);
    else place.hidden = true;
  } catch (error) {
    console.warn(error);
    wide.textContent = "This browser shows no space (WebGL); the pictures below show the parts in their places.";
  }
  const details = new Details(data, beside, chooseSeam, (panel) => choosePart(panel));

  for (const table of document.querySelectorAll("table.sortable")) sortable(table);
  for (const row of document.querySelectorAll("tr[data-part], tr[data-seam]")) row.tabIndex = 0;
  const act = (event) => {
    if (event.target.closest("a, button, .details")) return;
    const part = event.target.closest("[data-part]");
    const seam = event.target.closest("[data-seam]");
    if (seam) {
      chooseSeam(data.seams[Number(seam.dataset.seam)]);
      place.scrollIntoView({ block: "nearest" });
    } else if (part) chooseNumber(Number(part.dataset.part), true);
  };
  document.querySelector("main").addEventListener("click", act);
  document.querySelector("main").addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target.matches("tr")) act(event);
  });
  // Links to drawings choose the part, too.
  document.querySelector("main").addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#part-"]');
    const figure = link && document.getElementById(decodeURIComponent(link.getAttribute("href").slice(1)));
    if (figure) chooseNumber(Number(figure.dataset.part));
  });
  const gallery = document.querySelector(".gallery");
  if (gallery) {
    const fit = document.createElement("label");
    const box = Object.assign(document.createElement("input"), { type: "checkbox" });
    fit.className = "screen";
    fit.append(box, "all at one size, not at one scale");
    box.addEventListener("change", () => gallery.classList.toggle("fit", box.checked));
    gallery.before(fit);
  }
  // For scripts and tests.
  window.gsoPage = { data, state, viewer, choosePart, chooseNumber, chooseSeam, setInches };
}

start();
