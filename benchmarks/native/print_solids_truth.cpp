// Prints the ground truth of stub:solids (benchmarks/edges/curves.py):
//
//   print_solids_truth SCENE SEED WIDTH HEIGHT FRAMES
//
// prints {"cartons_m": [[x, y, z], ..], "frames": [[[[x, y, z], [x, y, z]], ..], ..]}: the sides of each box, and the
// parts of sharp edges that the camera sees in each of the first frames, in its coordinates, metres.
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "sources/synthetic/solids_scene.h"
#include "sources/synthetic/solids_truth.h"

namespace {

constexpr double kFramesPerSecond = 30;  // default of a stub

void print(const maq::Vector3& p) { std::printf("[%.9g, %.9g, %.9g]", p[0], p[1], p[2]); }

void print_truth(const maq::SolidsScene& scene, const maq::SolidsPicture& picture, int frames) {
  std::printf("{\"cartons_m\": [");
  const char* separator = "";
  for (const maq::Solid& solid : scene.solids) {
    if (!solid.is_carton) continue;
    std::printf("%s", separator);
    print(2 * solid.half);
    separator = ", ";
  }
  std::printf("], \"frames\": [");
  for (int k = 0; k < frames; ++k) {
    std::printf("%s[", k > 0 ? ", " : "");
    separator = "";
    const maq::SolidsView view = maq::solids_view(scene, k / kFramesPerSecond);
    for (const maq::VisibleSolidsEdge& edge : maq::visible_solids_edges(scene, view, picture)) {
      std::printf("%s[", separator);
      print(edge.from), std::printf(", "), print(edge.to), std::printf("]");
      separator = ", ";
    }
    std::printf("]");
  }
  std::printf("]}\n");
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 6) {
    std::fprintf(stderr, "usage: print_solids_truth SCENE SEED WIDTH HEIGHT FRAMES\n");
    return 2;
  }
  try {
    const maq::SolidsScene scene = maq::make_solids_scene(arguments[1], std::strtoull(arguments[2], nullptr, 10));
    print_truth(scene, {std::atoi(arguments[3]), std::atoi(arguments[4])}, std::atoi(arguments[5]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "print_solids_truth: %s\n", error.what());
    return 1;
  }
  return 0;
}
