// A fault behind five conditions, each in code of its own: by chance alone it takes 10^12 inputs, step by step
// some thousand.
#include <cstdint>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  volatile int reached = 0;
  if (size > 12 && data[3] == 'm') {
    reached = 1;
    if (data[5] == 'a') {
      reached = 2;
      if (data[7] == 'q') {
        reached = 3;
        if (data[9] == 'h') {
          reached = 4;
          if (data[11] == 0xff) std::abort();
        }
      }
    }
  }
  return reached < 0;
}
