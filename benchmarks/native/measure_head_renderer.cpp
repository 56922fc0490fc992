// Measures images of a rotating head, 640 x 480: `measure_head_renderer [head.maqh [threads [triangles]]]`. Without a
// head it renders a ball of that size. Prints the median time of the images of one turn and the processor time of each,
// with antialiasing and without.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <optional>
#include <vector>

#include "head/files/head_file.h"
#include "head/reconstruction/head_surface.h"
#include "head/render/head_renderer.h"
#include "support/samples/ball_mesh.h"

namespace {

constexpr int kWidth_px = 640, kHeight_px = 480, kPictures = 90;
constexpr double kTurn_rad = 2 * 3.14159265358979323846;

maq::head::HeadMesh mesh_of(const char* path, size_t triangles, int threads) {
  if (path == nullptr || *path == 0) return ball_mesh(0.0256f);
  maq::WorkerThreads workers(threads);
  return head_surface(maq::head::read_head_file(path), {0, triangles}, workers);
}

}  // namespace

int main(int argc, char** argv) try {
  const int threads = argc > 2 ? std::atoi(argv[2]) : 2;
  const maq::head::HeadMesh mesh =
      mesh_of(argc > 1 ? argv[1] : nullptr, argc > 3 ? size_t(std::atol(argv[3])) : 60000, threads);
  for (const bool is_smooth : {true, false}) {
    maq::head::HeadRenderOptions options;
    options.threads = threads, options.is_smooth = is_smooth;
    maq::head::HeadRenderer renderer(mesh, std::nullopt, options);
    maq::RenderedImage picture;
    std::vector<double> ms;
    std::clock_t before = 0;
    for (int i = 0; i <= kPictures; ++i) {
      if (i == 1) before = std::clock();
      const maq::PinholeCamera camera = renderer.orbit_camera(kTurn_rad * i / kPictures, 0.1, kWidth_px, kHeight_px);
      const auto start = std::chrono::steady_clock::now();
      renderer.render(camera, picture);
      const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
      if (i > 0) ms.push_back(taken.count());
    }
    const double processor_ms = 1e3 * double(std::clock() - before) / CLOCKS_PER_SEC / kPictures;
    std::sort(ms.begin(), ms.end());
    const double median_ms = ms[ms.size() / 2];
    std::printf(
        "{\"triangles\": %zu, \"threads\": %d, \"smooth_edges\": %s, \"ms\": %.2f, \"fps\": %.0f, "
        "\"processor_ms\": %.2f}\n",
        mesh.triangle_count(), threads, is_smooth ? "true" : "false", median_ms, 1000 / median_ms, processor_ms);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_head_renderer: %s\n", error.what());
  return 1;
}
