// Makes a button record a canvas as a film, until it is pressed again. Then the film is saved. name(): the file's name without its ending.
import { save } from "./base.js";

export const addRecorder = (button, canvas, name) => {
  if (!canvas.captureStream || !globalThis.MediaRecorder) { button.hidden = true; return; }
  let recorder = null;
  button.addEventListener("click", () => {
    if (recorder) { recorder.stop(); recorder = null; button.textContent = "Record film"; return; }
    const type = ["video/webm;codecs=vp8", "video/webm", "video/mp4"].find((format) => MediaRecorder.isTypeSupported(format));
    const chunks = [], newRecorder = new MediaRecorder(canvas.captureStream(60), { mimeType: type, videoBitsPerSecond: 8e6 });
    newRecorder.addEventListener("dataavailable", ({ data }) => chunks.push(data));
    newRecorder.addEventListener("stop", () => save(new Blob(chunks, { type }), `${name()}.${type.includes("mp4") ? "mp4" : "webm"}`));
    newRecorder.start();
    recorder = newRecorder;
    button.textContent = "Stop and save";
  });
};
