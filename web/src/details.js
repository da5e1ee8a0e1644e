// What is known about the part that was chosen: its drawing, its size, its seams and its bends.

import { onUnit, plain, withUnit, write } from "./units.js";

export class Details {
  constructor(data, place, chooseSeam, choosePart) {
    Object.assign(this, { data, place, chooseSeam, choosePart });
    this.place.className = "details";
    this.place.setAttribute("aria-live", "polite");
    this.show(null);
    onUnit(() => this.show(this.part, false));
  }

  show(number) {
    this.part = number;
    const { data, place } = this;
    if (number === null) {
      place.innerHTML = "<p>A click on a part, on its drawing or on its row shows the part here. Keys: arrows turn, + and - zoom, n and p choose the next and the previous part, Escape none.</p>";
      return;
    }
    const part = data.parts[number];
    place.replaceChildren();
    const title = add(place, "h3", part.name);
    if (part.count > 1) add(title, "small", ` ${part.count} times`);
    const figure = document.querySelector(`#drawings figure[data-part="${number}"]`);
    for (const own of figure?.querySelectorAll(":scope > svg") ?? []) {
      const copy = own.cloneNode(true);
      for (const one of copy.querySelectorAll("[id]")) one.removeAttribute("id");
      place.append(copy);
    }
    const drawing = place.querySelector(".drawing");
    if (figure) {
      const link = add(place, "a", "in the drawings");
      link.href = `#${figure.id}`;
    }
    add(place, "p", `${withUnit(part.length)} x ${withUnit(part.width)}`);
    if (part.faces?.length) add(place, "p", `made of ${part.faces.join(", ")}`);
    this.seams(part);
    this.bends(part, drawing);
    write(place);
  }

  seams(part) {
    const { data, place } = this;
    const own = data.seams.filter((seam) => seam.panels.some((panel) => part.panels.includes(panel)));
    if (!own.length) return;
    add(place, "h4", own.length > 1 ? `${own.length} seams` : "1 seam");
    const list = add(place, "ul");
    for (const seam of own) {
      const item = add(list, "li");
      const button = add(item, "button", `seam ${seam.number}`);
      button.type = "button";
      button.addEventListener("click", () => this.chooseSeam(seam));
      const others = seam.panels.filter((panel) => !part.panels.includes(panel));
      item.append(others.length ? " with " : " with itself");
      for (const other of others) {
        const mate = add(item, "button", data.panels[other].name);
        mate.type = "button";
        mate.addEventListener("click", () => this.choosePart(other));
      }
      const angle = seam.angle ? `, ${plain(Math.abs(seam.angle))}° ${seam.angle > 0 ? "down" : "up"}` : "";
      item.append(`, ${withUnit(seam.length)}${angle}`);
    }
  }

  bends(part, drawing) {
    if (!part.bends.length) return;
    const { place } = this;
    add(place, "h4", part.bends.length > 1 ? `${part.bends.length} bends` : "1 bend");
    const box = add(place, "div");
    box.className = "wide";
    const table = add(box, "table");
    const head = add(add(table, "thead"), "tr");
    for (const word of ["no", "way", "angle °", "radius"]) add(head, "th", word);
    const body = add(table, "tbody");
    const lines = new Map();
    for (const line of drawing?.querySelectorAll("[data-bend]") ?? []) lines.set(Number(line.dataset.bend), line);
    part.bends.forEach(([angle, radius], k) => {
      const row = add(body, "tr");
      row.tabIndex = 0;
      const cells = [k + 1, angle > 0 ? "down" : "up", Math.abs(angle).toFixed(2), radius === null ? "-" : withUnit(radius)];
      for (const text of cells) add(row, "td", String(text));
      const line = lines.get(k);
      if (!line) return;
      const mark = (on) => () => {
        line.classList.toggle("marked", on);
        row.classList.toggle("chosen", on);
      };
      for (const one of [row, line]) {
        one.addEventListener("pointerenter", mark(true));
        one.addEventListener("pointerleave", mark(false));
      }
      row.addEventListener("focus", mark(true));
      row.addEventListener("blur", mark(false));
      const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
      title.textContent = `bend ${k + 1}: ${cells[1]} ${plain(Math.abs(angle))}°, radius ${cells[3]}`;
      line.append(title);
    });
  }
}

function add(parent, tag, text) {
  const one = document.createElement(tag);
  if (text !== undefined) one.textContent = text;
  parent.append(one);
  return one;
}
