// Reads an MCAP file with only its own schemas, and prints a summary as JSON:
//   node read.mjs FILE
import { readFileSync } from "node:fs";
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

// The decoder for the messages of a schema.
function readerOf({ name, encoding, data }) {
  const schema = new TextDecoder().decode(data);
  if (encoding === "omgidl") {
    const reader = new MessageReader(name, parseIDL(schema));
    return { messageEncoding: "cdr", read: (bytes) => reader.readMessage(bytes) };
  }
  if (encoding === "jsonschema") {
    const { properties } = JSON.parse(schema);
    return {
      messageEncoding: "json",
      read: (bytes) => {
        const message = JSON.parse(new TextDecoder().decode(bytes));
        for (const key of Object.keys(message)) {
          if (!(key in properties)) throw new Error(`${key} is not in the schema`);
          if (properties[key].contentEncoding === "base64") message[key] = new Uint8Array(Buffer.from(message[key], "base64"));
        }
        return { schema: name, ...message };
      },
    };
  }
  throw new Error(`schema encoding ${encoding}`);
}

const file = readFileSync(process.argv[2]);
const decompressHandlers = { zstd: (chunk, size) => decompress(chunk, new Uint8Array(Number(size))) };
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(file);
const schemas = new Map();
const channels = new Map();
const out = { messages: [] };
for (let record; (record = stream.nextRecord()); ) {
  switch (record.type) {
    case "Header":
      out.profile = record.profile;
      out.library = record.library;
      break;
    case "Schema":
      schemas.set(record.id, readerOf(record));
      break;
    case "Channel":
      if (record.messageEncoding !== schemas.get(record.schemaId).messageEncoding) {
        throw new Error(`message encoding ${record.messageEncoding}`);
      }
      channels.set(record.id, record);
      break;
    case "Message": {
      const channel = channels.get(record.channelId);
      out.messages.push({
        topic: channel.topic,
        logTime: record.logTime,
        publishTime: record.publishTime,
        content: schemas.get(channel.schemaId).read(record.data),
      });
      break;
    }
    case "ChunkIndex":
      out.compression = record.compression;
      break;
    case "Statistics":
      out.statistics = { messages: record.messageCount, channels: record.channelCount };
      break;
  }
}
if (!stream.done()) throw new Error("the file has no proper end");
// Once more by the index at its end, which orders by time.
const indexed = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(file.length),
    read: async (offset, size) => new Uint8Array(file.subarray(Number(offset), Number(offset + size))),
  },
  decompressHandlers,
});
out.chunks = indexed.chunkIndexes.length;
out.indexed = 0;
let lastTime = 0n;
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  if (message.logTime < lastTime) throw new Error("messages out of order");
  lastTime = message.logTime;
  ++out.indexed;
}
const plain = (key, value) => {
  if (typeof value === "bigint") return value.toString();
  if (value instanceof Uint8Array) return Buffer.from(value).toString("hex");
  if (ArrayBuffer.isView(value)) return Array.from(value, (each) => plain("", each));
  return value;
};
console.log(JSON.stringify(out, plain));
