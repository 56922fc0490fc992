// The memory of the core: 32 MB at the beginning, at most 1 GB. It can always be shared by threads, but only a page that
// is isolated from other origins may send it to them.
export function createMemory() {
  const page = 65536;
  return new WebAssembly.Memory({ initial: (32 << 20) / page, maximum: (1 << 30) / page, shared: true });
}
