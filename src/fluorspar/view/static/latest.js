// One request in flight; of those that wait for it only the newest is ever sent.

/** Wraps async work: while it runs, calls replace each other, and the last one runs next. */
export function latest(work) {
  let running = false;
  let waiting = null;
  return async function ask(...wanted) {
    waiting = wanted;
    if (running) return;
    running = true;
    try {
      while (waiting) {
        const now = waiting;
        waiting = null;
        await work(...now);
      }
    } finally {
      running = false;
    }
  };
}
