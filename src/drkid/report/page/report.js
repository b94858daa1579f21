"use strict";
// The 3D part of the report: pieces as instances of their parts, moved by one slider, asked by click or number.
(function () {
  const kit = JSON.parse(document.getElementById("kit").textContent);
  const at = (id) => document.getElementById(id);
  const canvas = at("view"), told = at("told");
  const quietly = window.matchMedia("(prefers-reduced-motion: reduce)").matches;

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));
  const indices = (mesh) => floats(mesh.vertices).length / 3 < 65536 ? new Uint16Array(bytes(mesh.faces)) : new Uint32Array(bytes(mesh.faces));
  const shown = (x) => (x === 0 ? "0" : Math.abs(x) < 1e-6 ? "< 0.000001" : Number(x.toPrecision(3)).toString());

  let renderer = null;
  try { renderer = new T.WebGLRenderer({ canvas, antialias: true, alpha: true }); } catch (_) { renderer = null; }
  let scene, camera, orbit, meshes = [], ghost, selected = -1, wanted = true, home;
  const place = kit.pieces.map(() => null); // [instanced mesh, number in it] of each piece
  const matrices = kit.pieces.map((piece) => new T.Matrix4().set(...piece.matrix, 0, 0, 0, 1));

  // ---- what a piece is

  function colourOf(piece, by) {
    if (by === "class") return kit.classes[piece.class].colour;
    const most = kit.most[by] || 1, x = Math.min(1, piece[by] / most) * (kit.ramp.length - 1);
    const i = Math.min(kit.ramp.length - 2, Math.floor(x));
    const a = new T.Color(kit.ramp[i]), b = new T.Color(kit.ramp[i + 1]);
    return a.lerp(b, x - i);
  }

  function line(words) {
    const p = document.createElement("p");
    p.textContent = words;
    told.append(p);
  }

  function ask(index) {
    selected = index;
    told.replaceChildren();
    if (index < 0) { line("Click a piece, or give its number."); paint(); return; }
    const piece = kit.pieces[index];
    line(`Piece ${piece.step}: class ${kit.classes[piece.class].id}` + (piece.hand === "any" ? "" : `, ${piece.hand} hand`));
    line(`File ${kit.parts[piece.part].file}, face ${piece.face}`);
    line("Neighbours: " + piece.joints.map(([n, degrees]) => `${kit.pieces[n].step} (${kit.classes[kit.pieces[n].class].id}, ${degrees.toFixed(1)}°)`).join(", "));
    line(`Error ${shown(piece.error)} % of the mean edge`);
    line(`Sharpest joint bends by ${piece.bend.toFixed(1)}°`);
    line(`Distance to the surface ${shown(piece.distance)} % of the diagonal, mean`);
    at("piece").value = piece.step;
    paint();
  }

  // ---- the picture

  function build() {
    scene = new T.Scene();
    scene.add(new T.HemisphereLight(0xffffff, 0x8890a0, 1.9));
    const sun = new T.DirectionalLight(0xffffff, 1.9);
    sun.position.set(-0.5, 0.9, 1);
    camera = new T.PerspectiveCamera(35, 1, kit.radius / 50, kit.radius * 60);
    camera.up.set(0, 0, 1);
    camera.add(sun);
    scene.add(camera);
    kit.parts.forEach((part, number) => {
      const shared = new T.BufferGeometry();
      shared.setAttribute("position", new T.BufferAttribute(floats(part.vertices), 3));
      shared.setIndex(new T.BufferAttribute(indices(part), 1));
      const geometry = shared.toNonIndexed(); // each face has its own normal
      geometry.computeVertexNormals();
      const own = kit.pieces.map((_, i) => i).filter((i) => kit.pieces[i].part === number);
      const mesh = new T.InstancedMesh(geometry, new T.MeshLambertMaterial({}), own.length);
      mesh.frustumCulled = false;
      mesh.userData.pieces = own;
      own.forEach((i, n) => { place[i] = [mesh, n]; });
      meshes.push(mesh);
      scene.add(mesh);
    });
    const surface = new T.BufferGeometry();
    surface.setAttribute("position", new T.BufferAttribute(floats(kit.surface.vertices), 3));
    surface.setIndex(new T.BufferAttribute(indices(kit.surface), 1));
    surface.computeVertexNormals();
    ghost = new T.Mesh(surface, new T.MeshLambertMaterial({ color: 0x6f8fd0, transparent: true, opacity: 0.4, depthWrite: false, side: T.DoubleSide }));
    ghost.visible = false;
    scene.add(ghost);
    orbit = new T.OrbitControls(camera, canvas);
    orbit.enableDamping = !quietly;
    orbit.addEventListener("change", () => { wanted = true; });
    look();
  }

  function look() {
    const away = kit.radius / Math.sin((camera.fov / 2) * Math.PI / 180) * 1.12;
    orbit.target.set(...kit.middle);
    camera.position.set(...kit.eye).multiplyScalar(Math.max(away, away / camera.aspect)).add(orbit.target);
    orbit.update();
    wanted = true;
  }

  function move() {
    if (!renderer) return;
    const apart = at("explode").value / 100 * 1.2, last = Number(at("step").value);
    const gone = new T.Matrix4().makeScale(0, 0, 0), moved = new T.Matrix4();
    kit.pieces.forEach((piece, i) => {
      moved.copy(matrices[i]);
      const e = moved.elements;
      for (let k = 0; k < 3; k++) e[12 + k] += apart * (e[12 + k] - kit.middle[k]);
      const [mesh, n] = place[i];
      mesh.setMatrixAt(n, piece.step <= last ? moved : gone);
    });
    for (const mesh of meshes) { mesh.instanceMatrix.needsUpdate = true; mesh.computeBoundingSphere(); }
    wanted = true;
  }

  function paint() {
    const by = at("colour").value, last = Number(at("step").value);
    at("legend").hidden = by === "class";
    at("least").textContent = "0";
    at("most").textContent = by === "class" ? "" : `${shown(kit.most[by])} ${kit.units[by]}`;
    at("bar").style.background = `linear-gradient(90deg, ${kit.ramp.join(",")})`;
    if (!renderer) return;
    const white = new T.Color(0xffffff), tint = new T.Color();
    kit.pieces.forEach((piece, i) => {
      tint.set(colourOf(piece, by));
      if (i === selected) tint.lerp(white, 0.65);
      else if (piece.step === last && last < kit.pieces.length) tint.lerp(white, 0.35);
      const [mesh, n] = place[i];
      mesh.setColorAt(n, tint);
    });
    for (const mesh of meshes) mesh.instanceColor.needsUpdate = true;
    wanted = true;
  }

  function fit() {
    const box = canvas.parentElement.getBoundingClientRect();
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(box.width, box.height, false);
    camera.aspect = box.width / box.height;
    camera.updateProjectionMatrix();
    wanted = true;
  }

  function frame() {
    requestAnimationFrame(frame);
    orbit.update();
    if (!wanted) return;
    wanted = false;
    renderer.render(scene, camera);
  }

  function pieceAt(x, y) {
    const box = canvas.getBoundingClientRect(), ray = new T.Raycaster();
    ray.setFromCamera(new T.Vector2((x - box.left) / box.width * 2 - 1, 1 - (y - box.top) / box.height * 2), camera);
    const hit = ray.intersectObjects(meshes, false)[0];
    return hit ? hit.object.userData.pieces[hit.instanceId] : -1;
  }

  function turn(sideways, upwards) {
    const from = camera.position.clone().sub(orbit.target), r = from.length();
    let azimuth = Math.atan2(from.y, from.x) + sideways, height = Math.asin(from.z / r) + upwards;
    height = Math.max(-1.5, Math.min(1.5, height));
    from.set(r * Math.cos(height) * Math.cos(azimuth), r * Math.cos(height) * Math.sin(azimuth), r * Math.sin(height));
    camera.position.copy(orbit.target).add(from);
    wanted = true;
  }

  // ---- controls

  function toStep(step) {
    at("step").value = step;
    at("stepword").textContent = at("step").value;
    move();
    paint();
  }

  let playing = 0;
  function play(on) {
    clearInterval(playing);
    playing = 0;
    at("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    if (Number(at("step").value) >= kit.pieces.length) toStep(1);
    playing = setInterval(() => {
      const step = Number(at("step").value);
      if (step >= kit.pieces.length) play(false); else toStep(step + 1);
    }, Math.max(60, Math.min(400, 20000 / kit.pieces.length)));
  }

  at("colour").addEventListener("change", paint);
  at("explode").addEventListener("input", move);
  at("step").addEventListener("input", () => { play(false); toStep(at("step").value); });
  at("back").addEventListener("click", () => { play(false); toStep(Number(at("step").value) - 1); });
  at("forth").addEventListener("click", () => { play(false); toStep(Number(at("step").value) + 1); });
  at("play").addEventListener("click", () => play(!playing));
  at("ghost").addEventListener("change", () => { if (ghost) { ghost.visible = at("ghost").checked; wanted = true; } });
  at("piece").addEventListener("change", () => ask(kit.pieces.findIndex((p) => p.step === Number(at("piece").value))));
  at("reset").addEventListener("click", () => { at("explode").value = 0; play(false); toStep(kit.pieces.length); ask(-1); if (renderer) look(); });
  document.querySelector("form.controls").addEventListener("submit", (event) => event.preventDefault());

  if (!renderer) {
    canvas.hidden = true;
    at("fallback").hidden = false;
    paint();
    return;
  }
  build();
  fit();
  look();
  move();
  paint();
  new ResizeObserver(fit).observe(canvas.parentElement);
  let down = null;
  canvas.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; });
  canvas.addEventListener("pointerup", (event) => {
    const still = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 6;
    down = null;
    if (still) ask(pieceAt(event.clientX, event.clientY));
  });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] }[event.key];
    const zoom = { "+": 0.9, "=": 0.9, "-": 1.1 }[event.key];
    if (turns) turn(...turns);
    else if (zoom) { camera.position.sub(orbit.target).multiplyScalar(zoom).add(orbit.target); wanted = true; }
    else return;
    event.preventDefault();
  });
  frame();
})();
