/**
 * The peers of the live page: the same neurons and connections at the same places in the same window, each in a colour of
 * its own that changes with each frame. `measure(name, milliseconds)` tells how many frames a second are drawn.
 */

const { width, height, scale, discs, lines, fills, scene, widths } = await (await fetch('scene')).json();
const stage = document.getElementById('stage'), LEVELS = (fills.length - 1) / 2;
const css = fills.map((colour) => `#${colour.toString(16).padStart(6, '0')}`);

/** The level of a neuron at a time; a connection has that of its source. */
const level = (neuron, time) => LEVELS + Math.round(LEVELS * Math.sin(time / 300 + neuron));

/** Ours, without its run and its server: the live page's own drawing, with its labels and its legend. */
async function page() {
  const { Drawing } = await import('./page/draw.js'), { Camera } = await import('./page/camera.js');
  const canvas = Object.assign(document.createElement('canvas'), { width: width * scale, height: height * scale });
  const context = canvas.getContext('2d', { alpha: false }), drawing = new Drawing(scene), none = widths.map(() => 0);
  const camera = Object.assign(new Camera(), { size: [width, height], window: [canvas.width, canvas.height] });
  stage.append(canvas);
  return (now) => drawing.draw(context, camera, {
    discs: discs.map((_, at) => level(at, now) - LEVELS), lines: lines.map(({ from }) => level(from, now) - LEVELS),
    widths, glows: none, kinds: [...none, ...discs.map(() => 0)], caption: `${Math.round(now)} ms`,
  });
}

/** sigma.js: straight arrows; colours by its reducers. */
function sigma() {
  const graph = new graphology.MultiDirectedGraph();
  let time = 0;
  discs.forEach(([x, y, radius], at) => graph.addNode(at, { x, y: height - y, size: radius * scale, at }));
  lines.forEach(({ from, to, width }) => graph.addEdge(from, to, { size: width * scale, from }));
  const shown = new Sigma(graph, stage, {
    defaultEdgeType: 'arrow', renderLabels: false, stagePadding: 20, itemSizesReference: 'screen', minEdgeThickness: 0.5,
    nodeReducer: (_, data) => ({ ...data, color: css[level(data.at, time)] }),
    edgeReducer: (_, data) => ({ ...data, color: css[level(data.from, time)] }),
  });
  return (now) => {
    time = now;
    shown.refresh({ skipIndexation: true, schedule: false });
  };
}

/** pixi.js: a Graphics for each curve with its head, and for each disc, made once in white; colours by their tints. */
async function pixi() {
  const app = new PIXI.Application();
  await app.init({ width: width * scale, height: height * scale, background: 0xffffff, antialias: true, autoStart: false,
    preference: 'webgl', sharedTicker: false });
  stage.append(app.canvas);
  app.stage.scale.set(scale);
  const items = [];
  for (const { from, points, width: wide, head } of lines) {
    const line = new PIXI.Graphics().moveTo(points[0], points[1]);
    for (let i = 2; i + 5 < points.length; i += 6) line.bezierCurveTo(...points.slice(i, i + 6));
    line.stroke({ width: wide, color: 0xffffff }).poly(head).fill(0xffffff);
    items.push([line, from]);
  }
  discs.forEach(([x, y, radius], at) => items.push([new PIXI.Graphics().circle(x, y, radius).fill(0xffffff), at]));
  for (const [item] of items) app.stage.addChild(item);
  return (now) => {
    for (const [item, neuron] of items) item.tint = fills[level(neuron, now)];
    app.render();
  };
}

/** A canvas on which every line is stroked anew. */
function stroked() {
  const canvas = Object.assign(document.createElement('canvas'), { width: width * scale, height: height * scale });
  const context = canvas.getContext('2d', { alpha: false });
  stage.append(canvas);
  const paths = lines.map(({ points }) => {
    const path = new Path2D();
    path.moveTo(points[0], points[1]);
    for (let i = 2; i + 5 < points.length; i += 6) path.bezierCurveTo(...points.slice(i, i + 6));
    return path;
  });
  const heads = lines.map(({ head: [ax, ay, bx, by, cx, cy, dx, dy] }) => new Path2D(`M${ax} ${ay}L${bx} ${by}L${cx} ${cy}L${dx} ${dy}Z`));
  return (now) => {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = '#fff';
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(scale, 0, 0, scale, 0, 0);
    lines.forEach(({ from, width: wide }, at) => {
      context.strokeStyle = context.fillStyle = css[level(from, now)];
      context.lineWidth = wide;
      context.stroke(paths[at]);
      context.fill(heads[at]);
    });
    discs.forEach(([x, y, radius], at) => {
      context.fillStyle = css[level(at, now)];
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.fill();
    });
  };
}

/** Frames a second: of those that the display asks for, how many are drawn. */
window.measure = async (name, milliseconds) => {
  const draw = await { page, sigma, pixi, stroked }[name]();
  const frame = () => new Promise(requestAnimationFrame);
  for (let i = 0; i < 3; i++) draw(await frame());
  const begun = performance.now();
  let count = 0;
  do {
    draw(await frame());
    count++;
  } while (performance.now() - begun < milliseconds);
  return (1000 * count) / (performance.now() - begun);
};
window.ready = true;
