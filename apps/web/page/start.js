// Starts the worker, which compiles its module, before three.js is loaded.
const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
worker.onerror = () => { worker.hasFailed = true; };  // until the page listens
globalThis.quoinWorker = worker;
