// Millimetres and inches: every length on the page is written again when the unit changes.

const INCH = 25.4;
let inches = false;
const listeners = [];

export const onUnit = (call) => listeners.push(call);
export const isInches = () => inches;
export const unitName = () => (inches ? "in" : "mm");

export function length(mm, digits = 4) {
  if (mm === null || mm === undefined || !Number.isFinite(mm)) return "-";
  return plain(inches ? mm / INCH : mm, digits);
}

export const withUnit = (mm, digits) => (Number.isFinite(mm) ? `${length(mm, digits)} ${unitName()}` : "-");

// A number with some digits, without an exponent where it can be read without one.
export function plain(value, digits = 3) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

export function setInches(on) {
  inches = on;
  write(document);
  for (const call of listeners) call();
}

export function write(root) {
  for (const one of root.querySelectorAll("[data-mm]")) {
    const value = Number(one.dataset.mm);
    one.textContent = one.dataset.digits
      ? length(value, Number(one.dataset.digits))
      : inches ? (value / INCH).toFixed(3) : value.toFixed(1);
  }
  for (const one of root.querySelectorAll("[data-mm2]")) {
    const value = Number(one.dataset.mm2);
    one.textContent = inches ? (value / INCH ** 2).toFixed(2) : value.toFixed(0);
  }
  for (const one of root.querySelectorAll("[data-unit]"))
    one.textContent = unitName() + (one.dataset.unit === "mm2" ? "²" : "");
}
