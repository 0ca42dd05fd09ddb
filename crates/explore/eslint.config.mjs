// Lints of the page's modules and of who plays with it: mistakes, not style.
const names = [
  "window", "document", "location", "history", "navigator", "performance", "devicePixelRatio", "console",
  "process", "requestAnimationFrame", "cancelAnimationFrame", "setTimeout", "clearTimeout", "matchMedia",
  "getComputedStyle", "URL", "URLSearchParams", "Blob", "Response", "DecompressionStream", "ResizeObserver",
  "Image", "Node", "atob", "btoa", "createImageBitmap", "fetch", "ImageData", "DOMPoint", "HTMLCanvasElement",
  "structuredClone", "CSS", "DOMMatrix", "Element", "queueMicrotask",
];

export default [{
  files: ["**/*.js", "**/*.mjs"],
  languageOptions: {
    ecmaVersion: 2022, sourceType: "module", globals: Object.fromEntries(names.map((name) => [name, "readonly"])),
  },
  linterOptions: { reportUnusedDisableDirectives: "error" },
  rules: {
    "no-undef": "error", "no-unused-vars": "error", "no-redeclare": "error", "no-shadow": "error",
    "no-const-assign": "error", "no-dupe-keys": "error", "no-dupe-args": "error", "no-unreachable": "error",
    "no-self-assign": "error", "no-fallthrough": "error", "no-cond-assign": "error", "no-empty": "error",
    "valid-typeof": "error", "use-isnan": "error", "no-unsafe-finally": "error", "no-import-assign": "error",
    "no-var": "error", "prefer-const": "error", eqeqeq: "error", "no-eval": "error", "no-implied-eval": "error",
  },
}];
