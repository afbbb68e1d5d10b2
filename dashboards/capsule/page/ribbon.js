// A way on the floor as flat boxes, whole or dashed.
function liosRibbon(points, z, wide, colour, dash = null) {
  const out = { centre: [], size: [], yaw: [], colour: [] };
  const put = (a, b) => {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (length < 1e-4) return;
    out.centre.push((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, z);
    out.size.push(length + (dash ? 0 : wide * 0.8), wide, 0.012);
    out.yaw.push(Math.atan2(b[1] - a[1], b[0] - a[0]));
    out.colour.push(...colour, 255);
  };
  // As dashes() of marks.py: a dash stands by the line that it lies on, so that there and back fall together.
  for (let i = 1; i < points.length; i++) {
    const [a, b] = [points[i - 1], points[i]];
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (!dash || length < 1e-4) { put(a, b); continue; }
    let u = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    if (u[0] < -1e-6 || (Math.abs(u[0]) <= 1e-6 && u[1] < 0)) u = [-u[0], -u[1]];
    const dot = (p) => p[0] * u[0] + p[1] * u[1], from = dot(a), period = dash[0] + dash[1];
    const low = Math.min(from, dot(b)), high = Math.max(from, dot(b));
    const at = (s) => [a[0] + (s - from) * u[0], a[1] + (s - from) * u[1]];
    const first = Math.floor(low / period), turns = Math.min(Math.floor(high / period) - first, 20000);
    for (let k = first; k <= first + turns; k++) {
      const s = Math.max(low, k * period), e = Math.min(high, k * period + dash[0]);
      if (e > s) put(at(s), at(e));
    }
  }
  return out;
}
