// Checks .glb files by the Khronos validator: node validate_glb.js <folder with gltf-validator> <file>...
// Prints a line a file and what is wrong in it; ends with 1 where there is an error or a warning.
"use strict";
const fs = require("fs");
const path = require("path");
const [modules, ...files] = process.argv.slice(2);
const validator = require(path.resolve(modules, "node_modules/gltf-validator"));

(async () => {
  for (const file of files) {
    const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
    const { numErrors, numWarnings, messages } = issues;
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings; ${info.totalTriangleCount} triangles`);
    for (const m of messages.filter((m) => m.severity < 2)) console.log(`  ${m.code} ${m.pointer}: ${m.message}`);
    if (numErrors + numWarnings > 0 || !(info.totalTriangleCount > 0)) process.exitCode = 1;
  }
  if (files.length === 0) throw new Error("no file was given");
})();
