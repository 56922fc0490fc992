// Chains of points along the crests of the votes, split where they turn sharply.
#pragma once

#include <cstdint>
#include <vector>

#include "edges/curves/ridge_votes.h"

namespace maq {

struct RidgePoint {
  float x, y;    // px
  float tx, ty;  // direction along the edge, length 1, onward in its chain
};

struct RidgeChain {
  int first, count;  // of RidgeChains::points
  bool is_closed;
};

struct RidgeChains {
  std::vector<RidgePoint> points;
  std::vector<RidgeChain> chains;

  // Deterministic: the same votes give the same chains. Each pixel is in one chain.
  void trace(const RidgeVotes& votes, const CurveOptions& options, CurveCounts& counts);

 private:
  struct Crest {
    float x, y, nx, ny;
  };
  void find_crests(const RidgeVotes& votes, float least);
  void follow(RidgePoint from, int width, int height);
  void part_at_turns(RidgeChain chain, const CurveOptions& options, CurveCounts& counts);
  void keep(int first, int count, bool is_closed, const CurveOptions& options, CurveCounts& counts);

  std::vector<int> crest_of_;  // for each pixel: 0 none, else 1 + its crest
  std::vector<Crest> crests_;
  std::vector<uint8_t> is_used_;
  std::vector<float> turns_;
};

}  // namespace maq
