// What the robot in focus sees from where it is, and what it saw in passing. sight: radius, rays and steps, and the
// walls as rows of occupied cells; passed: [second, dots, eye], as FieldOfView and sight_marks.py have them.
function liosSight(renderer, { sight, passed }, shapes, colours, add) {
  const still = { centre: [0, 0, 0], size: [1, 1, 1], yaw: [0] }, none = { centre: [], size: [], yaw: [], colour: [] };
  const eyes = add(shapes.eye, none), dots = add(shapes.ball, none);
  let field = null, rim = null, outline = () => [];
  if (sight) {
    const { origin, cell, rows, columns, radius, rays, steps, up } = sight, wall = new Uint8Array(rows * columns);
    for (let i = 0; i < sight.occupied.length; i += 3) wall.fill(1, sight.occupied[i] * columns + sight.occupied[i + 1], sight.occupied[i] * columns + sight.occupied[i + 2]);
    const at = (x, y) => [Math.floor((y - origin[1]) / cell), Math.floor((x - origin[0]) / cell)];
    outline = (x, y) => {
      const [ownRow, ownColumn] = at(x, y);
      return Array.from({ length: rays }, (_, k) => {
        const turn = 2 * Math.PI * k / rays, [c, s] = [Math.cos(turn), Math.sin(turn)];
        let end = [x, y];
        for (let step = 1; step <= steps; step++) {
          const far = Math.min(step * cell / 2, radius);
          end = [x + c * far, y + s * far];
          const [row, column] = at(...end), inside = row >= 0 && row < rows && column >= 0 && column < columns;
          if ((row !== ownRow || column !== ownColumn) && !(inside && !wall[row * columns + column])) break;
        }
        return end;
      });
    };
    field = renderer.fan(rays);
    add(field, { ...still, colour: [...colours.inSight, 102] }, true);
    rim = add(shapes.box, none);
    field.up = up;
  }
  const show = (x, y, second) => {
    const ends = outline(x, y);
    if (field) {
      field.move([x, y], ends, field.up);
      rim.set(liosRibbon([...ends, ends[0]], field.up + 0.002, 0.03, colours.sight));
    }
    const seen = passed.filter(([s]) => s <= second + 1e-9);
    const balls = { centre: [], size: [], yaw: [], colour: [] }, marks = { centre: [], size: [], yaw: [], colour: [] };
    for (const [, line, eye] of seen) {
      marks.centre.push(...eye); marks.size.push(1, 1, 1); marks.yaw.push(0); marks.colour.push(...colours.sight, 255);
      for (let i = 0; i < line.length; i += 3) { balls.centre.push(...line.slice(i, i + 3)); balls.size.push(colours.dot, colours.dot, colours.dot); balls.yaw.push(0); balls.colour.push(...colours.sight, 255); }
    }
    eyes.set(marks);
    dots.set(balls);
    return { ends, seen: seen.length };
  };
  return { show };
}
