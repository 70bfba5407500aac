// Bundles each script of the pages into one file that needs nothing else: node build.mjs
import { build } from "esbuild";

await build({
  entryPoints: ["src/viewer.ts", "src/plots.ts"],
  outdir: "../src/qlb/results/static",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "utf8",
  legalComments: "inline",
  logLevel: "warning",
});
