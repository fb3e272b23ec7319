'use strict';
// What turns and follows the mouse. All numbers are on the page without it.
(() => {
const root = document.documentElement;
const problems = [];
addEventListener('error', e => { problems.push(e.message); root.dataset.problems = problems.join('; '); });
root.classList.add('scripted');
const data = JSON.parse(document.getElementById('data').textContent);
const $ = id => document.getElementById(id);
const css = name => getComputedStyle(root).getPropertyValue(name).trim();
const path = data.path, times = path.time_s, count = times.length;

/// Index of the moment nearest to a time.
function nearest(values, wanted) {
  let low = 0, high = values.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] < wanted) low = middle; else high = middle;
  }
  return wanted - values[low] < values[high] - wanted ? low : high;
}

// ---- one moment, shown everywhere at once
let current = -1;
const followers = [];
function show(index) {
  if (!count) return;
  current = Math.max(0, Math.min(count - 1, index));
  for (const follow of followers) follow(current);
}
const showTime = time => show(nearest(times, time));

// ---- plots
const mm = values => values.map(v => v === null ? null : v * 1e3);
/// null stands for what could not be measured.
const fixed = (value, digits) => value === null ? '\u2013' : value.toFixed(digits);
const depth = mm(path.inserted_m), distance = mm(path.target_distance_m);
const fromEntry = times.map(t => t - data.depth_time_zero_s);
const plots = {
  force_time: { x: times, lines: { axial: path.axial_n, lateral: path.lateral_n }, unit: 'N' },
  force_depth: { x: data.depth_mm, lines: { axial: path.axial_n, lateral: path.lateral_n }, unit: 'N' },
  depth_time: { x: fromEntry, lines: data.targets.length ? { depth, distance } : { depth }, unit: 'mm' },
};
const svgNode = (name, parent) => parent.appendChild(document.createElementNS(parent.namespaceURI, name));
function attach(id, plot) {
  const svg = $(id);
  if (!svg || !count) return;
  const { x0, x1, y0, y1, top, bottom } = Object.fromEntries(Object.entries(svg.dataset).map(([k, v]) => [k, Number(v)]));
  const share = v => (v - x0) / (x1 - x0);  // of the width
  const toY = v => bottom - (v - y0) / (y1 - y0) * (bottom - top);
  const cursor = svgNode('g', svg);
  cursor.setAttribute('class', 'cursor');
  const line = svgNode('line', cursor), text = svgNode('text', cursor);
  line.setAttribute('y1', top);
  line.setAttribute('y2', bottom);
  text.setAttribute('y', top + 14);
  const dots = Object.keys(plot.lines).map(() => { const c = svgNode('circle', cursor); c.setAttribute('r', 3.5); return c; });
  cursor.style.display = 'none';
  followers.push(i => {
    cursor.style.display = plot.x[i] === null ? 'none' : '';
    if (plot.x[i] === null) return;
    const x = `${100 * share(plot.x[i])}%`;
    line.setAttribute('x1', x);
    line.setAttribute('x2', x);
    const values = Object.values(plot.lines).map(values => values[i]);
    values.forEach((v, k) => {
      dots[k].style.display = v === null ? 'none' : '';
      dots[k].setAttribute('cx', x);
      dots[k].setAttribute('cy', toY(v ?? y0));
    });
    text.textContent = values.map(v => fixed(v, plot.unit === 'N' ? 2 : 1)).join(' / ') + ' ' + plot.unit;
    const late = share(plot.x[i]) > 0.5;
    text.setAttribute('x', x);
    text.setAttribute('dx', late ? -8 : 8);
    text.setAttribute('text-anchor', late ? 'end' : 'start');
  });
  svg.addEventListener('pointermove', e => {
    const box = svg.getBoundingClientRect();
    const at = (e.clientX - box.left) / box.width, py = e.clientY - box.top;
    if (plot.x !== data.depth_mm) { show(nearest(plot.x, x0 + at * (x1 - x0))); return; }
    // Against depth the needle comes by more than once: the nearest point of any line.
    let best = 0, least = Infinity;
    for (const values of Object.values(plot.lines)) {
      for (let i = 0; i < count; ++i) {
        if (plot.x[i] === null) continue;
        const d = ((share(plot.x[i]) - at) * box.width) ** 2 + (toY(values[i]) - py) ** 2;
        if (d < least) { least = d; best = i; }
      }
    }
    show(best);
  });
}
for (const [id, plot] of Object.entries(plots)) attach(id, plot);
for (const row of document.querySelectorAll('[data-time]')) {
  row.addEventListener('click', () => showTime(Number(row.dataset.time)));
}
const slider = $('time');
const place = tissue => tissue > 0 ? `in ${(data.tissues[tissue] ?? '?').replaceAll('_', ' ')}` : 'outside';
slider.addEventListener('input', () => show(Math.round(slider.value / 1000 * (count - 1))));
followers.push(i => {
  slider.value = count > 1 ? i / (count - 1) * 1000 : 0;
  $('now').textContent = `${times[i].toFixed(2)} s ${place(path.tissue[i])}: ` +
    `${depth[i].toFixed(1)} mm deep, ` + (distance[i] !== null ? `${fixed(distance[i], 1)} mm from the target, ` : '') +
    `${fixed(path.force_n[i], 2)} N`;
  const film = $('film_now');
  if (!film) return;
  const { file, from, to, speed } = film.dataset;
  film.href = `${file}#t=${((Math.min(Math.max(times[i], from), to) - from) / speed).toFixed(2)}`;
});

// ---- the needle's way
const canvas = $('way'), draw = canvas.getContext('2d');
const sub = (a, b) => a.map((v, k) => v - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
const points = path.tip_m, expert = data.expert_path ? data.expert_path.tip_m : [];

// Seen: what lies in tissue, the needle then, and the targets.
const focus = points.filter((_, i) => path.inserted_m[i] > 0).concat(data.shaft_m, data.targets.map(t => t.centre_m));
const seen = focus.length ? focus : points;
const centre = [0, 1, 2].map(k => {
  const v = seen.map(p => p[k]);
  return v.length ? (v.reduce((a, b) => Math.min(a, b)) + v.reduce((a, b) => Math.max(a, b))) / 2 : 0;
});
const reach = seen.reduce((r, p) => Math.max(r, Math.hypot(...sub(p, centre))), 0.02) * 1.15;
const start = { forward: unit(sub(centre, data.eye)), zoom: 1, shift: [0, 0] };
start.right = unit(cross(start.forward, data.up));
start.up = cross(start.right, start.forward);
let camera = { ...start };
function rotate(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle), a = cross(axis, v), d = dot(axis, v) * (1 - c);
  return v.map((x, k) => x * c + a[k] * s + axis[k] * d);
}
function turn(dx, dy) {
  const about = (axis, angle) => {
    for (const name of ['forward', 'right', 'up']) camera[name] = rotate(camera[name], axis, angle);
  };
  about(unit(data.up), -dx);
  about(camera.right, -dy);
}
function project(p) {
  const d = sub(p, centre), far = 4 * reach, z = dot(d, camera.forward);
  const scale = Math.min(canvas.width, canvas.height) / 2 / reach * camera.zoom * far / Math.max(far + z, far / 10);
  return [canvas.width / 2 + dot(d, camera.right) * scale, canvas.height / 2 - dot(d, camera.up) * scale, z, scale];
}
const speeds = points.map((p, i) => {
  const a = Math.max(0, i - 2), b = Math.min(count - 1, i + 2), dt = times[b] - times[a];
  return dt > 0 ? Math.hypot(...sub(points[b], points[a])) / dt : 0;
});
const fast = Math.max(...speeds.filter((_, i) => path.inserted_m[i] > 0).concat([0.02]));
function speedColour(v) {
  const s = Math.min(v / fast, 1);
  return `hsl(${220 - 200 * s} 75% ${48 + 4 * s}%)`;
}
const outlines = data.outlines.map(o => {
  const vertices = [];
  for (let i = 0; i < o.vertices_mm.length; i += 3) vertices.push(o.vertices_mm.slice(i, i + 3).map(v => v / 1e3));
  const triangles = [];
  for (let i = 0; i < o.triangles.length; i += 3) {
    const t = o.triangles.slice(i, i + 3), [a, b, c] = t.map(k => vertices[k]);
    triangles.push({ t, normal: unit(cross(sub(b, a), sub(c, a))) });
  }
  return { ...o, vertices, triangles };
});
const hidden = new Set([...document.querySelectorAll('.show_outline:not(:checked)')].map(i => Number(i.value)));
let byColour = 'tissue', showExpert = true, segments = 0;

function stroke(items, list, colourAt, width, dash) {
  for (let i = 0; i + 1 < list.length; ++i) {
    const a = project(list[i]), b = project(list[i + 1]);
    items.push({ z: (a[2] + b[2]) / 2 - 1e-4, line: [a, b], colour: colourAt(i), width, dash });
  }
}
function paint() {
  const items = [], ratio = canvas.width / canvas.clientWidth || 1, light = unit([-0.3, 0.4, 0.86]);
  segments = 0;
  outlines.forEach((o, k) => {
    if (hidden.has(k)) return;
    const at = o.vertices.map(project);
    for (const { t, normal } of o.triangles) {
      const [a, b, c] = t.map(i => at[i]);
      const shade = Math.abs(dot(normal, light));
      items.push({ z: (a[2] + b[2] + c[2]) / 3, face: [a, b, c], colour: o.colour, alpha: 0.05 + 0.11 * shade });
    }
  });
  if (showExpert) stroke(items, expert, () => css('--grey'), 2.2 * ratio, [7 * ratio, 5 * ratio]);
  stroke(items, points, i => byColour === 'speed' ? speedColour(speeds[i]) : data.tissue_colours[path.tissue[i]],
    4 * ratio);
  segments = Math.max(points.length - 1, 0);
  stroke(items, data.shaft_m, () => css('--ink'), 2.6 * ratio);
  for (const target of data.targets) items.push({ z: project(target.centre_m)[2], target });
  if (current >= 0) items.push({ z: -1e9, now: project(points[current]) });
  items.sort((a, b) => b.z - a.z);

  draw.clearRect(0, 0, canvas.width, canvas.height);
  draw.lineCap = 'round';
  for (const item of items) {
    if (item.face) {
      draw.globalAlpha = item.alpha;
      draw.fillStyle = item.colour;
      draw.beginPath();
      item.face.forEach((p, k) => k ? draw.lineTo(p[0], p[1]) : draw.moveTo(p[0], p[1]));
      draw.fill();
      draw.globalAlpha = 1;
    } else if (item.line) {
      draw.strokeStyle = item.colour;
      draw.lineWidth = item.width;
      draw.setLineDash(item.dash || []);
      draw.beginPath();
      draw.moveTo(item.line[0][0], item.line[0][1]);
      draw.lineTo(item.line[1][0], item.line[1][1]);
      draw.stroke();
      draw.setLineDash([]);
    } else if (item.target) {
      const [x, y, , scale] = project(item.target.centre_m), r = item.target.radius_m * scale;
      draw.strokeStyle = css('--green');
      draw.lineWidth = 2 * ratio;
      draw.beginPath();
      draw.arc(x, y, r, 0, 2 * Math.PI);
      draw.stroke();
      draw.beginPath();
      draw.moveTo(x - 5 * ratio, y); draw.lineTo(x + 5 * ratio, y);
      draw.moveTo(x, y - 5 * ratio); draw.lineTo(x, y + 5 * ratio);
      draw.stroke();
      draw.fillStyle = css('--ink');
      draw.font = `${13 * ratio}px sans-serif`;
      draw.fillText(item.target.name, x + r * 0.75 + 6 * ratio, y - r * 0.75);
    } else {
      draw.fillStyle = css('--card');
      draw.strokeStyle = css('--ink');
      draw.lineWidth = 2.5 * ratio;
      draw.beginPath();
      draw.arc(item.now[0], item.now[1], 6 * ratio, 0, 2 * Math.PI);
      draw.fill();
      draw.stroke();
    }
  }
  drawScale(ratio);
  canvas.dataset.segments = segments;
  canvas.dataset.faces = items.filter(i => i.face).length;
}
/// A bar of a round length at the depth of the centre.
function drawScale(ratio) {
  const [, , , scale] = project(centre);
  const wanted = canvas.width / 6 / scale;
  const length = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2].reduce((a, b) => Math.abs(b - wanted) < Math.abs(a - wanted) ? b : a);
  const x = 16 * ratio, y = canvas.height - 18 * ratio;
  draw.strokeStyle = draw.fillStyle = css('--dim');
  draw.lineWidth = 2 * ratio;
  draw.beginPath();
  draw.moveTo(x, y); draw.lineTo(x + length * scale, y);
  draw.stroke();
  draw.font = `${12.5 * ratio}px sans-serif`;
  draw.fillText(`${(length * 1e3).toFixed(0)} mm`, x, y - 6 * ratio);
}
let waiting = false;
function repaint() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; paint(); });
}
followers.push(repaint);
let drag = null;
canvas.addEventListener('pointerdown', e => { drag = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { drag = null; });
canvas.addEventListener('pointermove', e => {
  if (!drag) return;
  turn((e.clientX - drag[0]) * 0.008, (e.clientY - drag[1]) * 0.008);
  drag = [e.clientX, e.clientY];
  repaint();
});
canvas.addEventListener('wheel', e => {
  e.preventDefault();
  camera.zoom = Math.min(Math.max(camera.zoom * Math.exp(-e.deltaY * 0.001), 0.3), 12);
  repaint();
}, { passive: false });
canvas.addEventListener('dblclick', () => { camera = { ...start }; repaint(); });
canvas.addEventListener('keydown', e => {
  const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
  if (!step) return;
  e.preventDefault();
  turn(...step);
  repaint();
});
for (const input of document.querySelectorAll('input[name=colour]')) {
  input.addEventListener('change', () => { byColour = input.value; repaint(); });
}
for (const input of document.querySelectorAll('.show_outline')) {
  input.addEventListener('change', () => {
    if (input.checked) hidden.delete(Number(input.value)); else hidden.add(Number(input.value));
    repaint();
  });
}
if ($('show_expert')) $('show_expert').addEventListener('change', e => { showExpert = e.target.checked; repaint(); });
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', repaint);
addEventListener('resize', repaint);
showTime(data.arrival_s);
paint();
root.dataset.ready = '1';
})();
