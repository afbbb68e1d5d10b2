// Places the labels of things in the house over its picture. m: the camera's matrix; labels: those first that stay.
function liosPlaceLabels(canvas, m, labels, roomNames) {
  const [w, h] = [canvas.clientWidth, canvas.clientHeight], high = 18;
  const placed = [];
  const meets = (left, top, wide) =>
    placed.find((p) => left < p[0] + p[2] + 2 && p[0] < left + wide + 2 && top < p[1] + high && p[1] < top + high);
  const project = ([x, y, z]) => {
    const depth = m[3] * x + m[7] * y + m[11] * z + m[15];
    const across = (m[0] * x + m[4] * y + m[8] * z + m[12]) / depth, up = (m[1] * x + m[5] * y + m[9] * z + m[13]) / depth;
    return [(across * 0.5 + 0.5) * w, (0.5 - up * 0.5) * h, depth];
  };
  for (const made of labels) {
    const room = made.kind === "room";
    let on = made.visible && (!room || roomNames);
    if (on && made.measured !== made.div.textContent) { made.div.style.display = ""; made.measured = made.div.textContent; made.wide = made.div.offsetWidth; }
    // Labels do not cover one another: a mark is pushed up (down, at the edge); the name of a room takes another spot
    // of its floor, or gives way.
    let left = 0, top = 0;
    if (on && room) {
      on = made.spots.some((spot) => {
        const [x, y, depth] = project([...spot, 0.05]);
        [left, top] = [x - made.wide / 2, y - high / 2];
        return depth > 0.1 && !meets(left, top, made.wide);
      });
    } else if (on) {
      const [x, y, depth] = project(made.at);
      on = depth > 0.1;
      [left, top] = [x - made.wide / 2, y - high];
      if (top < 0 && top > -high) top = 0;
      for (let round = 0, way = -1; on && round < 16; round++) {
        const other = meets(left, top, made.wide);
        if (!other) break;
        if (way < 0 && other[1] - high - 1 < 0) way = 1; // no room left above
        top = other[1] + way * (high + 1);
      }
    }
    made.div.style.display = on ? "" : "none";
    if (!on) continue;
    placed.push([left, top, made.wide]);
    made.div.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
  }
}
