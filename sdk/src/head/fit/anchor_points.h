// Where a point of the template head lies on a head of given codes, by the anchors near it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "head/head_prior.h"

namespace maq::head {

// x(t; z) = t + sum over the nearest anchors k of w_k (mean_k + A_k z - t_k), with weights by the inverse square of the
// distance from t: linear in z, and exact at anchors.
class AnchorPoints {
 public:
  static constexpr size_t kNeighbours = 4;

  struct Place {
    std::array<size_t, kNeighbours> anchors{};
    std::array<double, kNeighbours> weights{};  // their sum is 1
    double distance_dm = 0;                     // of the nearest
    Vec3 mean;                                  // where the point lies with codes of 0
    double sigma_dm = 0;                        // residual of the linear function, for each coordinate
  };

  // Keeps a reference; of a prior that check_head_prior() accepts.
  explicit AnchorPoints(const HeadPrior& prior) : anchors_(prior.anchors), codes_(size_t(prior.shape_codes())) {}

  size_t codes() const { return codes_; }

  Place place(Vec3 template_point) const;

  // [3][codes], row by row: how the point changes with each code.
  void linear(const Place& place, double* rows) const;

  // `shape`: `codes()` of them.
  Vec3 point(const Place& place, const float* shape) const;

 private:
  const HeadAnchors& anchors_;
  size_t codes_;
};

}  // namespace maq::head
