// Colour maps: numbers to red, green, blue of 0 to 255.

// Viridis, by its colours at equal distances; and a map with a pale middle for signed values.
const SEQUENTIAL = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
const DIVERGING = [[33, 102, 172], [103, 169, 207], [209, 229, 240], [247, 247, 247], [253, 219, 199], [239, 138, 98], [178, 24, 43]];
const UNKNOWN = [150, 150, 150];

export const mapOf = (low, high) => (low < 0 && high > 0 ? DIVERGING : SEQUENTIAL);

export function colour(value, low, high, out = [0, 0, 0]) {
  if (!Number.isFinite(value)) return UNKNOWN;
  const map = mapOf(low, high);
  const share = high > low ? Math.min(Math.max((value - low) / (high - low), 0), 1) : 0;
  const at = Math.min(Math.floor(share * (map.length - 1)), map.length - 2);
  const rest = share * (map.length - 1) - at;
  for (let k = 0; k < 3; k++) out[k] = map[at][k] + rest * (map[at + 1][k] - map[at][k]);
  return out;
}

export const gradient = (low, high) =>
  `linear-gradient(to right, ${mapOf(low, high).map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
