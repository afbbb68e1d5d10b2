// Paints the 3D view with its labels and a caption on one canvas, as a picture or a frame of a film.
// caption: lines of [words, weight, colour], or null; stage: the element that the labels stand in.
function liosPaint(context, w, h, { canvas, stage, labels, caption }) {
  const sky = context.createLinearGradient(0, 0, 0, h);
  sky.addColorStop(0, "#eef3f8"); sky.addColorStop(1, "#fbfbfa");
  context.fillStyle = sky;
  context.fillRect(0, 0, w, h);
  context.drawImage(canvas, 0, 0, w, h);
  const scale = w / Math.max(1, canvas.clientWidth), box = stage.getBoundingClientRect();
  context.textBaseline = "middle";
  for (const made of labels) {
    if (made.div.style.display === "none") continue;
    const place = made.div.getBoundingClientRect(), plain = made.kind === "room";
    const [x, y, wide, high] = [place.left - box.left, place.top - box.top, place.width, place.height].map((v) => v * scale);
    if (!plain) { context.fillStyle = "rgba(255,255,255,0.85)"; context.beginPath(); context.roundRect(x, y, wide, high, 4); context.fill(); }
    const stripe = made.kind === "robot" ? 5 * scale : 0;
    if (stripe) { context.fillStyle = made.div.style.borderLeftColor; context.beginPath(); context.roundRect(x, y, stripe, high, [4, 0, 0, 4]); context.fill(); }
    const number = made.div.firstElementChild ? made.div.firstElementChild.textContent + ". " : "";
    const words = number + (number ? made.div.lastChild.textContent : made.div.textContent);
    context.font = `${made.kind === "robot" ? 650 : 400} ${(made.kind === "item" ? 10.5 : 12) * scale}px system-ui, sans-serif`;
    context.fillStyle = plain ? "#4a4f57" : "#23262b";
    context.textAlign = "center";
    context.fillText(words, x + (stripe + wide) / 2, y + high / 2);
  }
  if (!caption) return;
  const step = 19 * scale;
  context.textAlign = "left";
  caption.forEach(([words, weight, colour], i) => {
    context.font = `${weight} ${13.5 * scale}px system-ui, sans-serif`;
    const y = h - step * (caption.length - i) - 2 * scale;
    context.fillStyle = "rgba(255,255,255,0.8)";
    context.fillRect(10 * scale, y - step / 2, context.measureText(words).width + 12 * scale, step);
    context.fillStyle = colour || "#23262b";
    context.fillText(words, 16 * scale, y);
  });
}
