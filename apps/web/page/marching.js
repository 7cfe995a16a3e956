// The page's ray-marching mode: by WebGPU if an adapter supports the scene; otherwise by the module in the worker, when
// the view rests.
import { Marcher, openDevice } from './march.js';

const rest = 250;           // milliseconds without a change
const movingFrame = 60;     // maximum milliseconds per image while the view moves
const factors = [1, 2, 3, 4, 6, 8, 12];  // reductions of these images' resolution

let opening;  // a promise of the shared device

/** Renders on the device. Calls `lost` if the device is lost. */
class ByDevice {
  static async open(ask, canvas, lost) {
    opening ??= openDevice();
    const { device, name } = await opening.catch((error) => {
      opening = undefined;
      throw error;
    });
    device.lost.then(({ message }) => {
      opening = undefined;
      lost(message || 'the device is lost');
    });
    const by = new ByDevice();
    by.ask = ask;
    by.name = `WebGPU, ${name || 'an adapter without a name'}`;
    by.marcher = await Marcher.open(device, await ask('shaders', {}));
    by.context = canvas.getContext('webgpu');
    by.context.configure({ device, format: navigator.gpu.getPreferredCanvasFormat(), alphaMode: 'opaque' });
    by.pixelsPerMillisecond = 0;
    return by;
  }

  /** Returns the reduction of the resolution while the view moves. */
  factor(pixels) {
    const most = this.pixelsPerMillisecond * movingFrame;
    return factors.find((factor) => pixels / factor ** 2 <= most) ?? factors.at(this.pixelsPerMillisecond ? -1 : 5);
  }

  /** Renders the first sample while `wanted.first()` is true. At full resolution, adds more samples while
   *  `wanted.isSame()` is true. Calls `shown` after each sample. */
  async draw(view, factor, wanted, shown) {
    const [width, height] = [view.width, view.height].map((edge) => Math.max(Math.round(edge / factor), 1));
    const { frame } = await this.ask('frame', { ...view, width, height });
    if (!wanted.first()) return;
    this.marcher.begin(frame, width, height);
    do {
      const began = performance.now();
      if (!await this.marcher.addSample(this.marcher.samples === 0 ? wanted.first : wanted.isSame)) return;
      const milliseconds = performance.now() - began;
      this.pixelsPerMillisecond = width * height / milliseconds;
      this.marcher.show(this.context);
      shown({ by: this.name, milliseconds, width, height, samples: this.marcher.samples });
    } while (factor === 1 && !this.marcher.isFinished && wanted.isSame());
  }

  async read() {
    return this.marcher.read();
  }

  close() {
    this.marcher.close();
    this.context.unconfigure();
  }
}

/** Renders by the module: one image, and none while the view moves. */
class ByModule {
  constructor(ask, canvas, name) {
    this.ask = ask;
    this.name = name;
    this.context = canvas.getContext('2d');
  }

  factor() {
    return Infinity;
  }

  async draw(view, factor, wanted, shown) {
    const began = performance.now();
    const { width, height, rgba } = await this.ask('march', { ...view, samples: 1 });
    if (!wanted.isSame()) return;
    this.image = { width, height, rgba };
    this.context.putImageData(new ImageData(rgba, width, height), 0, 0);
    shown({ by: this.name, milliseconds: performance.now() - began, width, height, samples: 1 });
  }

  async read() {
    return this.image;
  }

  close() {}
}

export class MarchedView {
  #page;
  #by;       // one of the classes above; undefined: the mode is off
  #canvas;
  #changes = 0;
  #changed = 0;  // when
  #wake = () => {};
  #generation = 0;
  #finished = -1;  // the change that has a finished image
  #failed;         // { change, error } if rendering failed

  /** `page`: { ask, below (an element), view() => arguments of the worker's `frame`, shown(facts), said(text) }. */
  constructor(page) {
    this.#page = page;
  }

  get isOn() {
    return this.#by !== undefined;
  }

  /** Returns true if the canvas shows the current view. Otherwise three.js renders it. */
  get isShown() {
    return this.isOn && this.#canvas.dataset.shown === 'true';
  }

  /** Starts with the worker's scene. */
  async start() {
    this.stop();
    const generation = ++this.#generation;
    const isCurrent = () => generation === this.#generation;
    const by = await this.#open(isCurrent);
    if (!isCurrent()) return by?.close();
    this.#by = by;
    this.change();
    this.#run(isCurrent);
  }

  // Undefined if no longer needed.
  async #open(isCurrent) {
    this.#newCanvas();
    try {
      return await ByDevice.open(this.#page.ask, this.#canvas, (why) => isCurrent() && this.#fallBack(why));
    } catch (error) {
      return isCurrent() ? this.#byModule(error.message) : undefined;
    }
  }

  #byModule(why) {
    this.#page.said(`${why}: the processor draws when the view rests.`);
    this.#newCanvas();
    return new ByModule(this.#page.ask, this.#canvas, 'the processor');
  }

  #fallBack(why) {
    if (!this.isOn) return;
    this.#by.close();
    this.#by = this.#byModule(why);
    this.change();
  }

  // A canvas keeps its kind of context.
  #newCanvas() {
    this.#canvas?.remove();
    this.#canvas = document.createElement('canvas');
    this.#canvas.className = 'marched';
    this.#canvas.hidden = true;
    this.#page.below.before(this.#canvas);
  }

  stop() {
    ++this.#generation;
    this.#by?.close();
    this.#by = undefined;
    this.#canvas?.remove();
    this.#canvas = undefined;
    this.#wake();
  }

  /** Call when the view or the sun has changed. */
  change() {
    if (!this.isOn) return;
    ++this.#changes;
    this.#changed = performance.now();
    if (this.#by instanceof ByModule) this.#show(false);
    this.#wake();
  }

  /** Resolves with the finished image of the current view; undefined if the mode ends before. Rejects if rendering
   *  fails. */
  async read() {
    while (this.isOn && this.#finished !== this.#changes) {
      if (this.#failed?.change === this.#changes) throw this.#failed.error;
      await new Promise((done) => setTimeout(done, 50));
    }
    return this.#by?.read();
  }

  #show(isShown) {
    this.#canvas.hidden = !isShown;
    this.#canvas.dataset.shown = isShown;
  }

  // Shows every change at once at low resolution, and refines the image while no other change follows.
  async #run(isCurrent) {
    let drawn = 0;  // the change and resolution of the last image
    let factor = 1;
    while (isCurrent()) {
      const isNew = drawn !== this.#changes;
      if (!isNew && factor === 1) {
        await new Promise((wake) => { this.#wake = wake; });
        continue;
      }
      const by = this.#by;
      const view = this.#page.view();
      const finer = factor === Infinity ? 1 : Math.ceil(factor / 2);
      const next = isNew ? by.factor(view.width * view.height) : finer;
      const change = this.#changes;
      if (next !== Infinity) {
        if (!isNew && performance.now() - this.#changed < rest) {
          await new Promise((done) => setTimeout(done, 30));
          continue;
        }
        const isHere = () => isCurrent() && by === this.#by;
        const isSame = () => isHere() && change === this.#changes;
        await this.#draw(by, view, next, change, { isHere, isSame, first: isNew ? isHere : isSame });
      }
      drawn = change;
      factor = next;
    }
  }

  async #draw(by, view, factor, change, wanted) {
    if (this.#canvas.width !== view.width || this.#canvas.height !== view.height)
      Object.assign(this.#canvas, { width: view.width, height: view.height });
    try {
      await by.draw(view, factor, wanted, (facts) => {
        this.#show(true);
        if (factor === 1) this.#finished = change;
        this.#page.shown(facts);
      });
    } catch (error) {
      if (!wanted.isHere()) return;
      if (by instanceof ByModule) {
        this.#failed = { change, error };
        this.#page.said(error.message);
      } else {
        this.#fallBack(error.message);
      }
    }
  }
}
