// The cutting force over a revolution by the linear edge-force law (docs/models.md), in N and mm.

const TURN = 2 * Math.PI;
const SLICES = 4; // of an edge in each degree by which it lags

// What the teeth cut at a height: angles, the distance of each from the axis of rotation, and of each pair of
// passes how far the tool travels between them.
function teethAt(tool, feed, lag, runout) {
  const angles = tool.teeth, count = angles.length;
  const far = angles.map((angle) => runout.radius * Math.cos(runout.angle - angle + lag));
  const before = runout.radius ? angles : angles.slice(0, 1); // without runout the last pass has cleared most
  return angles.map((angle, j) => ({ angle: angle - lag, passes: before.map((_, k) => {
    const ahead = j + k + 1, other = ahead % count;
    const pitch = angles[other] + TURN * Math.floor(ahead / count) - angle;
    return { travel: (feed * count * pitch) / TURN, gap: far[j] - far[other] };
  }) }));
}

// Force on the tool along the feed, across it and along the axis at each degree, and the mean torque in N m.
// tool: radius, helix, teeth (angles), entry, exit, coefficients; angles in rad. cut: depth, feed per tooth.
function cutForce(tool, cut, runout) {
  const [ktc, krc, kac, kte, kre, kae] = tool.coefficients;
  const perDepth = Math.tan(tool.helix) / tool.radius;
  const slices = Math.max(4, Math.ceil((SLICES * Math.abs(perDepth) * cut.depth * 360) / TURN));
  const high = cut.depth / slices, force = { x: [], y: [], z: [] };
  const levels = Array.from({ length: slices }, (_, i) => perDepth * (i + 0.5) * high);
  const edges = levels.flatMap((lag) => teethAt(tool, cut.feed, lag, runout));
  let around = 0;
  for (let degree = 0; degree < 360; degree += 1) {
    let [x, y, z] = [0, 0, 0];
    for (const { angle, passes } of edges) {
      const phi = (((angle + (degree * TURN) / 360) % TURN) + TURN) % TURN;
      if (phi < tool.entry || phi > tool.exit) continue;
      const sine = Math.sin(phi), cosine = Math.cos(phi);
      let chip = Infinity;
      for (const { travel, gap } of passes) chip = Math.min(chip, travel * sine + gap);
      if (chip <= 0) continue;
      const t = (ktc * chip + kte) * high, r = (krc * chip + kre) * high, a = (kac * chip + kae) * high;
      x -= t * cosine + r * sine;
      y += t * sine - r * cosine;
      z += a;
      around += (t * tool.radius) / 360;
    }
    force.x.push(x);
    force.y.push(y);
    force.z.push(z);
  }
  return { ...force, torque: around / 1000 };
}
