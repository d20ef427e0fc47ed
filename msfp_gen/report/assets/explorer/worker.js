// The worker of the page: holds the modules and problems, and answers every request with a run.
"use strict";

const instances = [];
let problems = [];

onmessage = ({ data }) => {
  if (data.modules) {
    problems = data.problems.map(decoded);
    for (const bytes of data.modules) {
      instances.push(new WebAssembly.Instance(new WebAssembly.Module(bytes), {}));
      instances[instances.length - 1].exports._initialize();
      postMessage({ prepared: instances.length });
    }
    postMessage({ ready: true });
    return;
  }
  const { request, index, settings } = data;
  const begin = performance.now();
  let told = begin;
  const progress = (share) => {
    if (performance.now() - told < 100) return;
    told = performance.now();
    postMessage({ progress: share });
  };
  try {
    const found = solve(instances[problems[index].module], problems[index], settings, progress);
    const cost = performance.now() - begin;
    postMessage({ request, index, settings, found, cost }, [found.rows.buffer, found.extremes.buffer]);
  } catch (error) {
    postMessage({ request, index, failure: String(error.message ?? error) });
  }
};
