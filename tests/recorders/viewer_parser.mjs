// Runs the JSON Schema parser of Foxglove Studio, from a file of its npm package, over schemas and their messages.
//
//   node viewer_parser.mjs ASSET CHANNELS.json
//
// CHANNELS.json: [{topic, name, schema, messages: [...]}]. Prints, for each channel, the names of its types and fields,
// or the parser's error, and how many messages came through.

import { readFileSync } from "node:fs";

const [asset, channels] = process.argv.slice(2);
const source = readFileSync(asset, "utf8");
const start = source.indexOf("function parseJsonSchema(");
const end = source.indexOf("\n}\n", start) + 3;
const scope = "const base64 = { length: (text) => Buffer.from(text, 'base64').length, "
  + "decode: (text, out, at) => Buffer.from(text, 'base64').copy(out, at) };\n";
const parse = new Function(`${scope}${source.slice(start, end)}return parseJsonSchema;`)();

const answers = JSON.parse(readFileSync(channels, "utf8")).map(({ topic, name, schema, messages }) => {
  try {
    const { datatypes, postprocessValue } = parse(schema, name);
    const types = Object.fromEntries([...datatypes].map(([type, { definitions }]) => [type, definitions.map((d) => d.name)]));
    const shown = messages.map((message) => postprocessValue(message));
    return { topic, types, messages: shown.length };
  } catch (error) {
    return { topic, error: String(error) };
  }
});
console.log(JSON.stringify(answers));
