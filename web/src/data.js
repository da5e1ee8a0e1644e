// Read the data of the page: numbers from base64, as gso/workshop/page_arrays.py writes them.

const MISSING = 65535;

export async function load() {
  const data = await (await window.gsoUnpack("page-data")).json();
  const buffer = await (await window.gsoUnpack("page-arrays")).arrayBuffer();

  // Coordinates and values; NaN where there is none.
  function numbers(entry) {
    const { at, count, columns, low, step } = entry;
    const levels = new Uint16Array(buffer, at, count * columns);
    const out = new Float32Array(levels.length);
    for (let k = 0; k < levels.length; k++) {
      const column = k % columns;
      out[k] = levels[k] === MISSING ? NaN : low[column] + step[column] * levels[k];
    }
    return out;
  }

  function indices(entry) {
    const Type = entry.bits === 16 ? Uint16Array : Uint32Array;
    return new Type(buffer, entry.at, entry.count * entry.columns);
  }

  for (const design of data.designs) {
    design.mesh.points = numbers(design.mesh.points);
    design.mesh.triangles = indices(design.mesh.triangles);
  }
  for (const panel of data.panels) {
    // Without a pattern there is no flat image, and no part.
    for (const name of ["points", "flat"]) panel[name] = panel[name] && numbers(panel[name]);
    for (const name of ["triangles", "rim", "bends"]) panel[name] = indices(panel[name]);
    for (const [name, value] of Object.entries(panel.values)) {
      const count = panel.points.length / 3;
      if (value === null) panel.values[name] = null;
      else if (typeof value === "number") panel.values[name] = new Float32Array(count).fill(value);
      else panel.values[name] = numbers(value);
    }
  }
  data.seams.forEach((seam, k) => {
    seam.line = numbers(seam.line);
    seam.id = k;
  });
  data.parts.forEach((part, k) => {
    part.panels = data.panels.flatMap((panel, j) => (panel.part === k ? [j] : []));
  });
  return data;
}
