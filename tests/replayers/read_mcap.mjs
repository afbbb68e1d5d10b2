// Reads a log with @mcap/core and decodes every message with the schema that the file carries:
// protobuf by protobufjs, JSON by the language. Prints one JSON object.
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { loadDecompressHandlers } from "@mcap/support";
import internal from "@foxglove/schemas/internal.js";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

const { foxgloveMessageSchemas } = internal;
const path = process.argv[2];
const decompressHandlers = await loadDecompressHandlers();
const handle = await open(path, "r");
const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });

const counts = {}, decoders = new Map(), unpublished = new Set();
let scene = null, outcome = null, unknownFields = 0;
for (const schema of reader.schemasById.values()) {
  if (schema.encoding !== "protobuf") continue;
  const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
  decoders.set(schema.id, root.lookupType(schema.name));
  const published = foxgloveMessageSchemas[schema.name.replace("foxglove.", "")];
  if (!published) { unpublished.add(schema.name); continue; }
  const ours = new Set(decoders.get(schema.id).fieldsArray.map((field) => field.name.replace(/_/g, "").toLowerCase()));
  for (const field of published.fields) {
    if (!ours.has(field.name.replace(/_/g, "").toLowerCase())) unknownFields += 1;
  }
}
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const channel = reader.channelsById.get(message.channelId);
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
  if (channel.messageEncoding === "json") {
    const value = JSON.parse(new TextDecoder().decode(message.data));
    if (channel.topic === "/search/outcome") outcome = value;
  } else {
    const value = decoders.get(channel.schemaId).decode(message.data);
    if (channel.topic === "/viz/scene") scene = value.entities.map((entity) => entity.id);
  }
}
const attachments = [], metadata = [];
for await (const record of reader.readAttachments()) attachments.push(record.name);
for await (const record of reader.readMetadata()) metadata.push(record.name);

const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(await (await open(path, "r")).readFile());
let streamed = 0;
for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") streamed += 1;
await handle.close();
console.log(JSON.stringify({
  counts, outcome, scene, attachments, metadata, streamed, unpublished: [...unpublished], unknownFields,
  done: stream.done(),
}));
process.exit(0);
