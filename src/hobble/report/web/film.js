// A button that records a canvas as a film until it is pressed again. name(): the name of the film's file,
// without its ending.
import { save } from "./base.js";

export const film = (button, canvas, name) => {
  if (!canvas.captureStream || !globalThis.MediaRecorder) { button.hidden = true; return; }
  let recorder = null;
  button.addEventListener("click", () => {
    if (recorder) { recorder.stop(); recorder = null; button.textContent = "Record film"; return; }
    const type = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((t) => MediaRecorder.isTypeSupported(t));
    const chunks = [], made = new MediaRecorder(canvas.captureStream(60), { mimeType: type, videoBitsPerSecond: 8e6 });
    made.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    made.addEventListener("stop", () => save(new Blob(chunks, { type }), `${name()}.${type.includes("mp4") ? "mp4" : "webm"}`));
    made.start();
    recorder = made;
    button.textContent = "Stop and save";
  });
};
