// A testee in JavaScript: it decodes the frames of Thorlabs APT, and nothing else. Its tables are the registry's.
//
//     node testee.mjs generated/python/stagewire_apt/registry.json

import { readFileSync } from "node:fs";

const registry = JSON.parse(readFileSync(process.argv[2], "utf-8"));
const messages = new Map(); // id -> its messages: one, or several with a sub-message each
for (const message of registry.messages.filter((m) => m.id !== null)) {
  messages.set(message.id, [...(messages.get(message.id) ?? []), message]);
}
// The first four bytes, id and length, of packets that are also received without the data flag.
const withoutFlag = new Set(
  registry.messages.filter((m) => m.without_flag).flatMap((m) => m.layouts.map((l) => l.length * 0x10000 + m.id)),
);
const contexts = registry.messages.flatMap((m) => m.layouts).flatMap((l) => (l.when ? [l.when] : []));

class Refusal extends Error {
  constructor(code, detail) {
    super(detail);
    this.code = code;
  }
}

function refuse(code, detail) {
  throw new Refusal(code, detail);
}

// Decoding

function decode(raw, context) {
  if (raw.length < 6) refuse("truncated", `a header has 6 bytes, here are ${raw.length}`);
  const alternatives = messages.get(raw.readUInt16LE(0)) ?? refuse("unknown_message", "no message has this id");
  const withPacket = (raw[4] & 0x80) !== 0 || withoutFlag.has(raw.readUInt32LE(0));
  const length = withPacket ? raw.readUInt16LE(2) : 0;
  if (raw.length < 6 + length) refuse("truncated", `${length} bytes are declared, ${raw.length - 6} follow`);
  if (raw.length > 6 + length) refuse("trailing", `${raw.length - 6 - length} bytes behind the frame`);
  const message = chosen(alternatives, raw, withPacket, length);
  const most = Math.max(registry.framing.maximum_length, ...message.layouts.map((l) => l.longest ?? 0));
  if (length > most) refuse("bad_length", `its packets have at most ${most} bytes`);
  const packet = raw.subarray(6);
  const said = { message: message.name, dest: raw[4] & 0x7f, source: raw[5] };
  if (message.layouts.length === 0) {
    const fields = withPacket ? {} : parameters({ param1: null, param2: null }, raw);
    return { ...said, form: "undocumented", fields, data: withPacket ? packet.toString("hex") : null };
  }
  if (!withPacket) {
    const layout = message.layouts.find((l) => l.form === "header") ?? refuse("bad_length", "its packet is missing");
    return { ...said, form: "header", fields: parameters(layout, raw) };
  }
  const fitting = message.layouts.filter((l) => l.form !== "header" && l.length <= length);
  if (fitting.length === 0) refuse("bad_length", `no layout has ${length} bytes or less`);
  const layouts = fitting.filter((l) => l.length === Math.max(...fitting.map((each) => each.length)));
  const layout = layouts.find((l) => l.when === null || agrees(l.when, context));
  if (layout === undefined) {
    const shared = layouts[0].fields.filter((field) => layouts.every((l) => l.fields.some((f) => alike(f, field))));
    return { ...said, form: "data:undecided", fields: values(shared, packet), data: packet.toString("hex") };
  }
  const fields = values(layout.fields, packet);
  const extra = "longest" in layout ? [] : packet.subarray(layout.length);
  return { ...said, form: layout.form, fields, ...(extra.length > 0 && { extra: extra.toString("hex") }) };
}

// Messages that share an id differ in their sub-message: the first word of a packet, or param1 of a header.
function chosen(alternatives, raw, withPacket, length) {
  if (alternatives[0].sub_message === undefined) return alternatives[0];
  if (withPacket && length < 2) refuse("bad_length", "its sub-message is missing");
  const value = withPacket ? raw.readUInt16LE(6) : raw[2];
  const found = alternatives.find((m) => m.sub_message === value);
  return found ?? refuse("unknown_message", `no message of this id has the sub-message ${value}`);
}

const agrees = (when, context) => Object.entries(when).every(([key, value]) => context[key] === value);
const alike = (one, other) => ["name", "offset", "size", "kind"].every((key) => one[key] === other[key]);

// The parameters of a header; one that has no name is said where it is not zero.
function parameters(layout, raw) {
  const fields = {};
  for (const [key, at] of [["param1", 2], ["param2", 3]]) {
    if (layout[key] !== null) fields[layout[key].name ?? key] = raw[at];
    else if (raw[at] !== 0) fields[key] = raw[at];
  }
  return fields;
}

function values(fields, packet) {
  const read = {};
  for (const field of fields) {
    const part = packet.subarray(field.offset, field.kind === "array" ? undefined : field.offset + field.size);
    if (field.kind === "bytes") read[field.name] = part.toString("hex");
    else if (field.kind === "text") read[field.name] = part.toString("latin1").replace(/\0+$/, "");
    else if (field.kind === "array") read[field.name] = items(field, part, read);
    else read[field.name] = integer(part, 0, field.size, field.signed);
  }
  return read;
}

const integer = (bytes, at, size, signed) => (signed ? bytes.readIntLE(at, size) : bytes.readUIntLE(at, size));

// The integers of an array, row by row. A column may stand once for each bit that is set in another field.
function items({ name, array: { columns, item_size: size, rows }, signed }, bytes, read) {
  const bits = (value) => value.toString(2).replaceAll("0", "").length;
  const width = columns.reduce((sum, { each }) => sum + (each === null ? 1 : bits(read[each])), 0);
  const count = read[rows] * width;
  if (bytes.length !== count * size) refuse("bad_length", `${name} has ${count} integers of ${size} bytes`);
  return Array.from({ length: count }, (_, index) => integer(bytes, index * size, size, signed));
}

// Lines

const KEYS = { hello: ["id", "op"], decode: ["id", "op", "protocol", "hex", "context"] };
const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);

function answer(request) {
  if (typeof request.op !== "string") refuse("bad_request", "op names the operation");
  const keys = KEYS[request.op] ?? refuse("unsupported", `there is no operation ${request.op}`);
  for (const key of Object.keys(request)) {
    if (!keys.includes(key)) refuse("bad_request", `${request.op} does not know ${key}`);
  }
  if (request.op === "hello") {
    const operations = ["hello", "decode"];
    return { testee: 1, implementation: "small-javascript", version: "1", protocols: [registry.protocol], operations };
  }
  const { protocol, hex, context = {} } = request;
  if (typeof protocol !== "string") refuse("bad_request", "protocol is a text");
  if (protocol !== registry.protocol) refuse("unsupported", `there is no protocol ${protocol}`);
  if (typeof hex !== "string" || !/^([0-9A-Fa-f]{2})*$/.test(hex)) refuse("bad_request", "hex is pairs of hex digits");
  if (!isObject(context)) refuse("bad_request", "context is an object");
  for (const [key, value] of Object.entries(context)) {
    if (typeof value !== "string") refuse("bad_request", `context ${key} is a text`);
    if (!contexts.some((when) => when[key] === value)) refuse("bad_value", `nothing depends on ${key} ${value}`);
  }
  return decode(Buffer.from(hex, "hex"), context);
}

function answerLine(line) {
  let id = null;
  try {
    const request = JSON.parse(new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(line));
    if (!isObject(request)) refuse("bad_request", "a request is an object");
    if (typeof request.id !== "string" && !Number.isInteger(request.id)) refuse("bad_request", "id is a number or a text");
    id = request.id;
    return { id, ok: true, ...answer(request) };
  } catch (error) {
    return { id, ok: false, error: codeOf(error), detail: error.message || "no request" };
  }
}

const codeOf = (error) => (error instanceof Refusal ? error.code : "bad_request");

let pieces = [];
for await (const chunk of process.stdin) {
  let start = 0;
  for (let end; (end = chunk.indexOf(10, start)) >= 0; start = end + 1) {
    const line = Buffer.concat([...pieces, chunk.subarray(start, end)]);
    pieces = [];
    process.stdout.write(`${JSON.stringify(answerLine(line))}\n`);
  }
  if (start < chunk.length) pieces.push(chunk.subarray(start));
}
