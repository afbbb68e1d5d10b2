// Places the labels of things in the house over its picture. m: the camera's matrix; labels: those first that stay.
function liosPlaceLabels(canvas, m, labels, roomNames) {
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const placed = [];
  for (const made of labels) {
    const [x, y, z] = made.at, depth = m[3] * x + m[7] * y + m[11] * z + m[15], room = made.kind === "room";
    let on = made.visible && depth > 0.1 && (!room || roomNames);
    if (on && made.measured !== made.div.textContent) { made.div.style.display = ""; made.measured = made.div.textContent; made.wide = made.div.offsetWidth; }
    const left = ((m[0] * x + m[4] * y + m[8] * z + m[12]) / depth * 0.5 + 0.5) * w - made.wide / 2, high = 18;
    let top = (0.5 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / depth * 0.5) * h - (room ? high / 2 : high);
    // Labels do not cover one another: a mark is pushed up (down, at the edge), the name of a room gives way.
    if (top < 0 && top > -high) top = 0;
    for (let round = 0, way = -1; on && round < 16; round++) {
      const other = placed.find((p) => left < p[0] + p[2] + 2 && p[0] < left + made.wide + 2 && top < p[1] + high && p[1] < top + high);
      if (!other) break;
      if (room) { on = false; break; }
      if (way < 0 && other[1] - high - 1 < 0) way = 1; // no room left above
      top = other[1] + way * (high + 1);
    }
    made.div.style.display = on ? "" : "none";
    if (!on) continue;
    placed.push([left, top, made.wide]);
    made.div.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px)`;
  }
}
