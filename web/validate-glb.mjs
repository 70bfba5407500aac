// Says what Khronos's validator finds in glTF files, as JSON: node validate-glb.mjs FILE...
import { readFileSync } from "node:fs";
import { basename } from "node:path";
import { validateBytes } from "gltf-validator";

const reports = [];
for (const path of process.argv.slice(2)) {
  reports.push(
    await validateBytes(new Uint8Array(readFileSync(path)), { uri: basename(path), maxIssues: 100 }),
  );
}
console.log(JSON.stringify(reports));
