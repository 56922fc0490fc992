// A head's distance at the corners of a grid: where rays go in, roughly, without running the network along them.
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "head/field/field_engine.h"
#include "head/head_prior.h"

namespace maq::head {

class DistanceGrid {
 public:
  // Creates a grid of `side`^3 corners, 2 to 128, over the prior's domain; the head ends at the prior's clip plane.
  DistanceGrid(const HeadBounds& bounds, const CutPlane& cut, int side);

  // Computes the distances from the current weights of the engine.
  void update(const FieldEngine& engine, WorkerThreads& threads);

  // The first point of base + depth * direction, with depth > first, that lies in the head; else the one nearest to it.
  struct Nearest {
    bool is_in_domain = false;  // the ray meets the domain; below is 0 where not
    bool is_hit = false;
    double depth = 0;
    double distance_dm = 0;  // 0 for a hit
    // Where what the ray passes on its way inwards begins, `enough_dm` outside or where the domain does, and where it
    // ends: as far inside, or where the ray no longer comes nearer.
    double begin = 0, end = 0;
  };
  Nearest find(Vec3 base, Vec3 direction, double first, double enough_dm) const;

  // Between the corners, linear along each axis. Of a point in the domain.
  double at(Vec3 p) const;
  double cell_dm() const;  // the longest edge

 private:
  HeadBounds bounds_;
  CutPlane cut_;
  int side_;
  Vec3 origin_, cells_per_dm_;
  std::vector<float> values_;  // [z][y][x]
  std::vector<FieldWorkspace> workspaces_;
};

}  // namespace maq::head
