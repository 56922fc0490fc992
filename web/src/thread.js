// A further thread of the core: emscripten's messages, as a module. `load` brings memory and code, `run` a function.
import createCore from './maquette-core.mjs';

let core = null;

const commands = {
  load({ wasmMemory, wasmModule }) {
    core = {
      ENVIRONMENT_IS_PTHREAD: true,
      wasmMemory,
      buffer: wasmMemory.buffer,
      instantiateWasm(imports, receive) {
        const instance = new WebAssembly.Instance(wasmModule, imports);
        receive(instance);
        return instance.exports;
      },
    };
    createCore(core); // answers by itself
  },
  run({ time, threadInfoStruct, start_routine: start, arg }) {
    core.__performance_now_clock_drift = performance.now() - time;
    core.__emscripten_thread_init(threadInfoStruct, 0, 0, 1);
    core.establishStackSpace();
    core.PThread.threadInit();
    core.__emscripten_thread_exit(core.invokeEntryPoint(start, arg));
  },
};

self.onmessage = ({ data }) => commands[data.cmd]?.(data);
