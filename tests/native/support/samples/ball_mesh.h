// A ball of radius 1 as a mesh of a head, whose colours and template points are those of its place.
#pragma once

#include <cmath>
#include <cstdint>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"

// Colours are 127.5 + 100 (x, y, z), template points (x, y, z) / 2.
inline maq::head::HeadMesh ball_mesh(float cell) {
  maq::WorkerThreads threads(2);
  maq::head::MarchingCubesOptions options;
  options.box_min = {-1.2f, -1.2f, -1.2f}, options.box_max = {1.2f, 1.2f, 1.2f}, options.cell = cell;
  maq::head::HeadMesh mesh = marching_cubes(
      [](const float* x, const float* y, const float* z, float* f, size_t n) {
        for (size_t i = 0; i < n; ++i) f[i] = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]) - 1;
      },
      options, threads);
  set_normals(mesh);
  for (const float position : mesh.positions) {
    mesh.colours.push_back(uint8_t(std::lround(127.5f + 100 * position)));
    mesh.template_points.push_back(position / 2);
  }
  return mesh;
}
