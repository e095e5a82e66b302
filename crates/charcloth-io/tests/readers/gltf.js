// The Khronos validator finds nothing in a .glb. Arguments: folder of the installed packages, .glb file.
const { readFileSync } = require("fs");
const validator = require(process.argv[2] + "/gltf-validator");
// Texture coordinates are there for the textures of whoever opens the file; ours uses none.
const options = { ignoredIssues: ["UNUSED_OBJECT"] };
validator.validateBytes(new Uint8Array(readFileSync(process.argv[3])), options).then((report) => {
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(JSON.stringify(messages.slice(0, 5)));
  if (numErrors + numWarnings + numInfos + numHints === 0) console.log("SOUND", report.info.animationCount);
});
