// Writes a recording anew with the library of MCAP, as tools of robotics do:
//   node rewrite.mjs IN.mcap FOLDER
// Prints the names of the files in FOLDER.
import { readFileSync, writeFileSync } from "node:fs";
import { McapStreamReader, McapWriter } from "@mcap/core";
import { decompress } from "fzstd";

const [input, folder] = process.argv.slice(2);
const reader = new McapStreamReader({
  decompressHandlers: { zstd: (chunk, size) => decompress(chunk, new Uint8Array(Number(size))) },
});
reader.append(readFileSync(input));
const schemas = new Map();
const channels = new Map();
const messages = [];
for (let record; (record = reader.nextRecord()); ) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Message") messages.push(record);
}

async function write(name, options, order, foreign = false) {
  const parts = [];
  let size = 0n;
  const writable = {
    write: async (bytes) => {
      parts.push(Buffer.from(bytes));
      size += BigInt(bytes.byteLength);
    },
    position: () => size,
  };
  const writer = new McapWriter({ writable, ...options });
  await writer.start({ profile: "", library: "rewrite.mjs" });
  if (foreign) {
    const data = new TextEncoder().encode("{}");
    const schemaId = await writer.registerSchema({ name: "tf", encoding: "jsonschema", data });
    const channelId = await writer.registerChannel({ schemaId, topic: "/tf", messageEncoding: "json", metadata: new Map() });
    for (const logTime of [0n, messages[0].logTime, messages.at(-1).logTime])
      await writer.addMessage({ channelId, sequence: 0, logTime, publishTime: logTime, data });
    await writer.addAttachment({ logTime: 0n, createTime: 0n, name: "notes.txt", mediaType: "text/plain", data });
  }
  const ids = new Map();
  for (const message of order) {
    if (!ids.has(message.channelId)) {
      const channel = channels.get(message.channelId);
      const schemaId = await writer.registerSchema(schemas.get(channel.schemaId));
      ids.set(message.channelId, await writer.registerChannel({ ...channel, schemaId }));
    }
    await writer.addMessage({ ...message, channelId: ids.get(message.channelId) });
  }
  await writer.end();
  writeFileSync(`${folder}/${name}.mcap`, Buffer.concat(parts));
  console.log(name);
}

const topic = (message) => channels.get(message.channelId).topic;
const byTopic = [...messages].sort((a, b) => (topic(a) < topic(b) ? -1 : topic(a) > topic(b) ? 1 : 0));
const since1970 = messages.map((message) => ({ ...message, logTime: message.logTime - messages[0].logTime }));
const unindexed = { useMessageIndex: false, useChunkIndex: false, useStatistics: false, useSummaryOffsets: false };
await write("same", {}, messages);
await write("topics", {}, byTopic);
await write("topics-in-one-chunk", { chunkSize: 1 << 28 }, byTopic);
await write("topics-without-chunks", { useChunks: false }, byTopic);
await write("topics-without-index", { ...unindexed, repeatSchemas: false, repeatChannels: false, chunkSize: 1 << 16 }, byTopic);
await write("tiny-chunks", { chunkSize: 1024 }, messages);
await write("since-1970", {}, since1970);
await write("with-others", {}, messages, true);
