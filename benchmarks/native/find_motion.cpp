// Prints the motion from each frame of a clip to the next, as predictors estimate it (benchmarks/prediction_quality).
//
//   find_motion WIDTH HEIGHT < frames > motion    BGR, rows without padding; float32 [T - 1, HEIGHT, WIDTH, 2], in
//                                                 pixels to the right and down
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "prediction/flow/optical_flow.h"

namespace {

int find_motion(int width, int height) {
  if (width < 1 || height < 1) return 2;
  maq::WorkerThreads threads(1);
  maq::LumaPyramid before, now;
  maq::OpticalFlow optical_flow;
  maq::FlowField flow;
  std::vector<uint8_t> pixels(size_t(width) * size_t(height) * 3);
  std::vector<float> motion(size_t(width) * size_t(height) * 2);
  bool is_first = true;
  while (std::fread(pixels.data(), 1, pixels.size(), stdin) == pixels.size()) {
    now.set(maq::packed_view(MAQ_PIXEL_BGR8, width, height, pixels.data()), threads);
    if (now.scale() != 1) {
      std::fprintf(stderr,
                   "find_motion: the motion of so large frames is found at a smaller size; make them smaller\n");
      return 2;
    }
    if (!is_first) {
      optical_flow.find(before, now, threads, flow);
      for (size_t i = 0; i < flow.dx_px.size(); ++i) {
        motion[2 * i] = flow.dx_px[i];
        motion[2 * i + 1] = flow.dy_px[i];
      }
      if (std::fwrite(motion.data(), sizeof(float), motion.size(), stdout) != motion.size()) return 1;
    }
    is_first = false;
    std::swap(before, now);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 3) return find_motion(std::atoi(argv[1]), std::atoi(argv[2]));
  std::fprintf(stderr, "usage: find_motion WIDTH HEIGHT < frames > motion\n");
  return 2;
} catch (const std::exception& error) {
  std::fprintf(stderr, "find_motion: %s\n", error.what());
  return 1;
}
