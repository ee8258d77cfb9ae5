// Counts the messages of a log with the reader of another project: node read_mcap.mjs FILE
import { McapIndexedReader } from "@mcap/core";
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
let messages = 0;
for await (const _ of reader.readMessages()) messages += 1;
console.log(JSON.stringify({ messages }));
