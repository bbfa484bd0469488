// Prints the Khronos validator's report of one file as JSON: node validate.js MODULES FILE
const fs = require("fs");
const path = require("path");

const [modules, file] = process.argv.slice(2);
const validator = require(path.join(modules, "gltf-validator"));
validator
  .validateBytes(new Uint8Array(fs.readFileSync(file)))
  .then((report) => console.log(JSON.stringify(report)))
  .catch((error) => {
    console.error(error);
    process.exit(1);
  });
