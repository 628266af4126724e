// A camera that moves around its target. The user moves it by dragging, pinching, pressing keys, or turning the wheel with Ctrl.

// home: where it starts and returns to: {yaw, pitch} in radians, {distance} in cm, and the limits {nearest, furthest} of the distance.
// changed(): called after every movement.
export const createOrbit = (canvas, home, changed) => {
  const orbit = { ...home };
  const { nearest = 140, furthest = 1500 } = home;

  orbit.turn = (yaw, pitch) => {
    orbit.yaw += yaw;
    orbit.pitch = Math.min(1.45, Math.max(.02, orbit.pitch + pitch));
    changed();
  };
  orbit.nearer = (factor) => {
    orbit.distance = Math.min(furthest, Math.max(nearest, orbit.distance * factor));
    changed();
  };
  orbit.reset = () => { Object.assign(orbit, home); changed(); };
  // key -> what it does
  orbit.keys = {
    ArrowLeft: () => orbit.turn(-.1, 0), ArrowRight: () => orbit.turn(.1, 0), ArrowUp: () => orbit.turn(0, .07),
    ArrowDown: () => orbit.turn(0, -.07), "+": () => orbit.nearer(.9), "=": () => orbit.nearer(.9),
    "-": () => orbit.nearer(1.1),
  };
  // Listens to the keys while `element` has the focus.
  orbit.listen = (element) => element.addEventListener("keydown", (event) => {
    const action = orbit.keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || event.target !== element || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });

  const touches = new Map(); // pointer -> where it is, [x, y] in pixels
  const fingerDistance = () => { const [p, q] = [...touches.values()]; return Math.max(1, Math.hypot(p[0] - q[0], p[1] - q[1])); };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = touches.get(event.pointerId);
    if (!before) return;
    const was = touches.size === 2 ? fingerDistance() : 0;
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    if (touches.size === 2) orbit.nearer(was / fingerDistance());
    else orbit.turn(-(event.clientX - before[0]) / 160, (event.clientY - before[1]) / 220);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => touches.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // without Ctrl the page scrolls
    event.preventDefault();
    orbit.nearer(Math.exp(event.deltaY / 300));
  }, { passive: false });
  return orbit;
};
