// The colours that the console has in this browser.
try {
  const theme = JSON.parse(localStorage.getItem("hedgehop.theme"));
  if (theme === "dark" || theme === "light") document.documentElement.dataset.theme = theme;
} catch {
  // Storage is forbidden: daylight colours stay.
}
