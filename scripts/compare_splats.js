// Compares two files of splats that splat-transform wrote as CSV: node compare_splats.js EXACT.csv COARSE.csv
// The second one may differ by the steps of an SPZ file.
const fs = require("fs");

const [exact, coarse] = process.argv.slice(2).map((path) => {
  const lines = fs.readFileSync(path, "utf8").trim().split("\n");
  return { names: lines[0].split(","), rows: lines.slice(1).map((line) => line.split(",").map(Number)) };
});
const limits = [[/^[xyz]$/, 0.001], [/^scale_/, 0.032], [/^f_dc_/, 0.014], [/^opacity$/, 0.6]];
if (exact.rows.length === 0 || exact.rows.length !== coarse.rows.length) {
  throw new Error(`${exact.rows.length} splats became ${coarse.rows.length}.`);
}
for (const [pattern, limit] of limits) {
  for (const name of exact.names.filter((column) => pattern.test(column))) {
    const here = exact.names.indexOf(name), there = coarse.names.indexOf(name);
    exact.rows.forEach((row, index) => {
      const difference = Math.abs(row[here] - coarse.rows[index][there]);
      if (!(difference <= limit)) throw new Error(`${name} of splat ${index} differs by ${difference}.`);
    });
  }
}
let turned = 0;
exact.rows.forEach((row, index) => {
  let product = 0;
  for (let part = 0; part < 4; ++part) {
    product += row[exact.names.indexOf(`rot_${part}`)] * coarse.rows[index][coarse.names.indexOf(`rot_${part}`)];
  }
  if (Math.abs(Math.abs(product) - 1) > 1e-4) turned += 1;
});
if (turned > 0) throw new Error(`${turned} rotations differ.`);
console.log(`${exact.rows.length} splats are equal in both files.`);
