// The scripts of the pages. They are put into a page one after the other, so that a function of one is known in the next.
const browser = [
  "AbortController", "Blob", "DecompressionStream", "MutationObserver", "OffscreenCanvas", "ResizeObserver", "Response",
  "URL", "URLSearchParams", "VideoEncoder", "VideoFrame", "addEventListener", "atob", "btoa", "clearTimeout", "console",
  "document", "Event", "history", "HTMLInputElement", "PointerEvent", "location", "matchMedia", "navigator", "performance", "requestAnimationFrame",
  "sessionStorage", "setInterval", "setTimeout", "window",
];
const ours = [
  "liosRenderer", "liosCamera", "liosUpper", "liosInterpolate", "liosClock", "liosRibbon", "liosSight", "liosPlaceLabels", "liosPaint",
  "liosTheme", "liosScaleBar",
];

export default [
  {
    files: ["dashboards/**/*.js"],
    languageOptions: {
      ecmaVersion: 2022,
      sourceType: "script",
      globals: Object.fromEntries([...browser, ...ours].map((name) => [name, "readonly"])),
    },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "no-undef": "error",
      "no-unused-vars": ["error", { varsIgnorePattern: "^lios" }],
      "prefer-const": "error",
      "no-var": "error",
      eqeqeq: "error",
      "no-shadow": ["error", { hoist: "functions", builtinGlobals: false }],
      "no-unreachable": "error",
      "no-dupe-keys": "error",
      "no-fallthrough": "error",
      "no-self-assign": "error",
      "no-empty": "error",
      "no-eval": "error",
      "no-implied-eval": "error",
      "use-isnan": "error",
      "valid-typeof": "error",
      "max-lines": ["error", 400],
    },
  },
];
