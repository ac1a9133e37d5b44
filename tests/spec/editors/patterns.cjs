// Reads a JSON array of [pattern, texts] and prints for each text whether JavaScript finds the pattern in it.
// The patterns are compiled as in the language server.
"use strict";
const { readFileSync } = require("node:fs");

const cases = JSON.parse(readFileSync(0, "utf8"));
const found = cases.map(([pattern, texts]) => {
  const compiled = new RegExp(pattern, "u");
  return texts.map((text) => compiled.test(text));
});
process.stdout.write(JSON.stringify(found));
