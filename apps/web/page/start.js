// Before three.js is read the worker, which compiles its module, is on its way.
const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
worker.onerror = () => { worker.hasFailed = true; };  // until the page listens
globalThis.quoinWorker = worker;
