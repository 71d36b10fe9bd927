// Dark and light: as the system has it, unless somebody chose otherwise in this browser.

const KEY = "fluorspar-theme";
const ORDER = ["system", "light", "dark"];

function kept() {
  try {
    return localStorage.getItem(KEY) ?? "system";
  } catch {
    return "system"; // storage is forbidden in some embedded pages
  }
}

function put(theme) {
  if (theme === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
}

export function startTheme() {
  put(kept());
}

/** The next theme, in words. */
export function nextTheme() {
  const now = document.documentElement.dataset.theme ?? "system";
  const systemIsDark = matchMedia("(prefers-color-scheme: dark)").matches;
  // the first click must be seen to do something
  const order = systemIsDark ? ORDER : ["system", "dark", "light"];
  const next = order[(order.indexOf(now) + 1) % order.length];
  put(next);
  try {
    localStorage.setItem(KEY, next);
  } catch {
    // then it lasts as long as the page
  }
  return `Now: ${next === "system" ? "as the system has it" : next}`;
}
