// Light or dark, as the system prefers it, until somebody chooses. chosen: "light", "dark", or "" for the system's.
function liosTheme(button, chosen, changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const theme = { chosen };
  const apply = () => {
    const name = theme.chosen || (system.matches ? "dark" : "light");
    document.documentElement.dataset.theme = name;
    button.textContent = name === "dark" ? "Light" : "Dark";
  };
  theme.set = (name) => { theme.chosen = name; apply(); changed(); };
  theme.toggle = () => theme.set(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
  system.addEventListener("change", apply);
  button.onclick = theme.toggle;
  apply();
  return theme;
}

// A bar of a round length, true to scale in the middle of the picture. metresAPixel: there, across.
function liosScaleBar(bar, metresAPixel) {
  const power = 10 ** Math.floor(Math.log10(110 * metresAPixel));
  const metres = [5, 2, 1].map((m) => m * power).find((m) => m <= 110 * metresAPixel) || power;
  bar.style.width = `${(metres / metresAPixel).toFixed(1)}px`;
  bar.textContent = metres < 1 ? `${Math.round(100 * metres)} cm` : `${metres} m`;
}
