// Before three.js is read the worker, which compiles its module, is on its way.
globalThis.quoinWorker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
