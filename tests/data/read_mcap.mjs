// Reads every message of a log with the readers of another project: node read_mcap.mjs FILE
// Those for viewers are decoded by the schemas in the file. Prints counts by topic.
import { McapIndexedReader } from "@mcap/core";
import { protobufFromBinaryDescriptor } from "@mcap/support";
import { open } from "fs/promises";
import zstd from "@foxglove/wasm-zstd";

await zstd.isLoaded;
const file = await open(process.argv[2]);
const { size } = await file.stat();
const readable = {
  size: async () => BigInt(size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};
const decompressHandlers = { zstd: (data, length) => zstd.decompress(data, Number(length)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const types = new Map();
const messages = {};
const decoded = {};
for await (const { channelId, data } of reader.readMessages()) {
  const { topic, messageEncoding, schemaId } = reader.channelsById.get(channelId);
  messages[topic] = (messages[topic] ?? 0) + 1;
  if (messageEncoding !== "protobuf") continue;
  if (!types.has(topic)) {
    const schema = reader.schemasById.get(schemaId);
    types.set(topic, protobufFromBinaryDescriptor(schema.data).lookupType(schema.name));
  }
  const type = types.get(topic);
  const wrong = type.verify(type.toObject(type.decode(data)));
  if (wrong) throw new Error(`${topic}: ${wrong}`);
  decoded[topic] = type.fullName.replace(/^\./, "");
}
console.log(JSON.stringify({ messages, decoded }));
