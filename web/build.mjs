// Bundles each script of the pages into one file that needs nothing else: node build.mjs
import { readFileSync } from "node:fs";
import { build } from "esbuild";

const kept = { viewer: "three", plots: "plotly.js-basic-dist-min" };

for (const [script, library] of Object.entries(kept)) {
  const licence = readFileSync(`node_modules/${library}/LICENSE`, "utf8").trim();
  await build({
    entryPoints: [`src/${script}.ts`],
    outdir: "../src/qlb/results/static",
    banner: { js: `/*! Of qlb (Apache-2.0), and of ${library}:\n${licence}\n*/` },
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    charset: "utf8",
    logLevel: "warning",
  });
}
