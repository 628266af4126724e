"""The report in a browser: its size, the time until the figure walks, and what a frame of Play costs.

    python benchmarks/report.py [results/injured/report.html ...] [--seconds 5] [--width 1280]

Headless Chromium draws without a graphics card, many times slower than any laptop. The milliseconds of the
character do not depend on that. They are compared with the 16.7 ms of a frame at 60 Hz, and with Python's
frame of the same network, if `--python` names its folder. The time until the figure at the top walks is also
given as processor time of the page's main thread, which depends less on other work on the machine.
"""

import argparse
import importlib.util
import tempfile
import time
from pathlib import Path
from types import ModuleType

from hobble.core.processors import processor_name

FRAME = 1000 / 60
ROOT = Path(__file__).resolve().parents[1]

CHARACTER = """(async () => {
  const out = {};
  for (const [name, spec] of Object.entries(Hobble.material.playable)) {
    const c = Hobble.character(spec), times = [];
    for (let f = 0; f < 900; f++) {
      const before = performance.now();
      c.frame([0, 2.5], null, "walk", () => 0);
      if (f >= 300) times.push(performance.now() - before);
    }
    times.sort((a, b) => a - b);
    out[name] = [times[300], times.at(-6)];
  }
  return out;
})()"""
DRAWING = """(async (seconds) => {
  const view = document.getElementById("play-view"), times = [];
  view.scrollIntoView({ behavior: "instant", block: "center" });
  const frame = () => new Promise(requestAnimationFrame);
  for (let warm = 0; warm < 10; warm++) await frame();
  const start = performance.now();
  let last = start;
  while (performance.now() - start < 1000 * seconds) {
    await frame();
    view.getContext("2d").getImageData(0, 0, 1, 1);  // waits until the picture is there
    times.push(performance.now() - last);
    last = performance.now();
  }
  times.sort((a, b) => a - b);
  return { frames: times.length, median: times[times.length >> 1], view: [view.width, view.height] };
})"""


# When the first picture of the walking figure was drawn, ms after the page was asked for.
WALKS = """performance.getEntriesByName('figures-walk')[0]?.startTime
  ?? (globalThis.Hobble?.ready && !Hobble.hero ? -1 : 0)"""  # -1: no figure at the top


def browser_module() -> ModuleType:
    """The tests' own driver of the browser."""
    spec = importlib.util.spec_from_file_location("browser", ROOT / "tests" / "report" / "browser.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def python_milliseconds(weights: Path) -> float:
    """The median frame of the Python runtime on the same network, ms."""
    from hobble.runtime.animation import ProceduralAnimation

    character, times = ProceduralAnimation.load(weights), []
    for _ in range(900):
        before = time.perf_counter()
        character.next_pose((0.0, 2.5), None, "walk")
        times.append(1000 * (time.perf_counter() - before))
    return sorted(times[300:])[300]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pages", nargs="*", type=Path, default=[ROOT / "results/injured/report.html"])
    parser.add_argument("--seconds", type=float, default=5.0, help="how long Play is watched")
    parser.add_argument("--width", type=int, default=1280, help="of the window, pixels")
    parser.add_argument("--python", type=Path, help="folder of the same network, to compare with")
    arguments = parser.parse_args()
    print(processor_name())
    tools = browser_module()
    path = tools.executable()
    if path is None:
        raise SystemExit(f"no browser here ({', '.join(tools.BROWSERS)})")
    for page in arguments.pages:
        print(f"{page}: {page.stat().st_size / 1e6:.1f} MB, of 20 allowed")
        with tempfile.TemporaryDirectory() as folder:
            browser = tools.Browser(path, Path(folder), arguments.width, 900)
            browser.send("Performance.enable", timeDomain="threadTicks")
            browser.send("Page.navigate", url=page.resolve().as_uri())
            if (walks := browser.until(WALKS, 60)) > 0:
                tasks = {m["name"]: m["value"] for m in browser.send("Performance.getMetrics")["metrics"]}
                print(
                    f"  the figure walks after {walks:.0f} ms (goal: 1,500), "
                    f"{1000 * tasks['TaskDuration']:.0f} ms of processor time of the main thread"
                )
            browser.until("globalThis.Hobble?.ready", 60)
            timing = "performance.getEntriesByType('navigation')[0]"
            opened = browser.run(
                f"[{timing}.responseEnd, {timing}.domContentLoadedEventEnd, {timing}.loadEventEnd]"
            )
            print("  read after {:.0f} ms, ready after {:.0f} ms, loaded after {:.0f} ms".format(*opened))
            for name, (median, slow) in browser.run(CHARACTER).items():
                ratio = ""
                if arguments.python:
                    ratio = f", {median / python_milliseconds(arguments.python):.1f} times Python's"
                share = f"{median / FRAME:.1%} of a frame at 60 Hz"
                print(
                    f"  character {name}: {median:.2f} ms a frame ({share}{ratio}), "
                    f"one in a hundred over {slow:.2f} ms"
                )
            drawn = browser.run(f"{DRAWING}({arguments.seconds})")
            width, height = drawn["view"]
            print(
                f"  Play at {width} x {height} on software GL: {drawn['median']:.0f} ms from picture to "
                f"picture, {1000 / drawn['median']:.0f} a second"
            )
            browser.close()


if __name__ == "__main__":
    main()
