// The measured curve of another run beside the one that is drawn, at the places of that.

const NO_OTHER = "no other run";

// Runs of a plot, by name, that have a curve like the one shown: of the same axis and part.
function alike(plot, shown) {
  const run = plot.keys.indexOf("run");
  if (run < 0) return new Map();
  const same = (curve) => curve.key.every((part, i) => (i === run ? part !== shown.key[i] : part === shown.key[i]));
  return new Map(plot.curves.filter(same).map((curve) => [curve.key[run], curve]));
}

// What another curve has at a place, on the straight line between its neighbours; nothing over a gap.
function between(x, y, gaps, place) {
  const after = x.findIndex((each) => each >= place);
  if (after < 0 || (after === 0 && x[0] > place)) return NaN;
  if (x[after] === place) return y[after];
  if (gaps.has(after)) return NaN;
  const share = (place - x[after - 1]) / (x[after] - x[after - 1]);
  return y[after - 1] + share * (y[after] - y[after - 1]);
}

function besideLine(run, other, curve) {
  const x = unpack(other.x), y = unpack(other.lines[0].y), gaps = new Set(other.gaps || []);
  const at = curve.rows
    ? curve.rows.map((row) => (other.rows.includes(row) ? y[other.rows.indexOf(row)] : NaN))
    : Array.from(curve.x, (place) => between(x, y, gaps, place));
  return { name: `measured, ${run}`, look: "other", y: at };
}
