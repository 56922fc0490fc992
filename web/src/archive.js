// The files of the networks' bundle in one file: the length of a JSON text (32 bits, little-endian), this text with name
// and size of each file, then the files.
export function packArchive(files) {
  const entries = Object.entries(files);
  const head = new TextEncoder().encode(JSON.stringify(entries.map(([name, bytes]) => [name, bytes.length])));
  const size = entries.reduce((sum, [, bytes]) => sum + bytes.length, 4 + head.length);
  const archive = new Uint8Array(size);
  new DataView(archive.buffer).setUint32(0, head.length, true);
  archive.set(head, 4);
  let at = 4 + head.length;
  for (const [, bytes] of entries) {
    archive.set(bytes, at);
    at += bytes.length;
  }
  return archive;
}

export function unpackArchive(archive) {
  const length = new DataView(archive.buffer, archive.byteOffset).getUint32(0, true);
  let at = 4 + length;
  const files = {};
  for (const [name, size] of JSON.parse(new TextDecoder().decode(archive.subarray(4, at)))) {
    files[name] = archive.subarray(at, at + size);
    at += size;
  }
  return files;
}
