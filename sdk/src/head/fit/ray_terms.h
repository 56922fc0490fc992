// How well a head explains the pixels of its photos, along rays, with the gradient by its codes and cameras.
//
// The matte is compared with the opacity of sections around where the ray goes in, or passes nearest. Template point
// and colour are those of the point p where it goes in: on the ray p = o + t d, so where the distance f changes
// there by df, or o and d change, p moves along d by -(df + grad f . (do + t dd)) / (grad f . d), and with it what is
// seen there (implicit differentiation, as in IDR, arXiv 2003.09852).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/worker_threads.h"
#include "head/camera/scaled_pose.h"
#include "head/field/field_parts.h"
#include "head/fit/distance_grid.h"
#include "head/fit/fit_rays.h"
#include "head/fit/opacity.h"
#include "head/head_prior.h"

namespace maq::head {

// Each term is a negative log likelihood a ray, with the noise that is named here, times its weight. Colours move the
// colour codes alone: light and shadows are no shape. The encoder's normals have no term: they err by some 16 degrees,
// alike over whole cheeks, and without them held-out heads are nearer.
struct RayTermOptions {
  double colour_weight = 1, matte_weight = 1, point_weight = 1;
  double colour_sigma = 0.12;      // of 0..1, each channel: mostly light that the prior does not know
  double matte_error_rate = 0.05;  // the fraction of mattes that say nothing
  double point_sigma_dm = 0.03;    // of the field's template points, beside the encoder's own
  double limit = 9;                // in squared sigmas: the limit of a robust error
  int sections = 12;
};

struct RaySums {
  double colour = 0, matte = 0, point = 0;  // weighted
  size_t rays = 0, hits = 0, coloured = 0;
  size_t left_out = 0;  // points whose numbers are not finite

  double total() const { return colour + matte + point; }
  void add(const RaySums& other);
};

// The gradients of RaySums::total().
struct RayGradient {
  FieldWeights by_weights;                                  // of the personal layers
  std::vector<std::array<double, kPoseUnknowns>> by_poses;  // of each photo
};

class RayTerms {
 public:
  // `sharpness` in 1/dm. The work is split into the same parts whatever the number of threads, so that this does not
  // show in a result.
  RayTerms(const FieldShape& shape, const CutPlane& cut, double sharpness, const RayTermOptions& options);

  // Sums the terms of `count` rays, with the weights of the engine and of the grid. `gradient` may be null; otherwise
  // it is overwritten.
  RaySums run(const FieldEngine& engine, const DistanceGrid& grid, const std::vector<ScaledPose>& poses,
              const FitRay* const* rays, size_t count, WorkerThreads& threads, RayGradient* gradient);

 private:
  static constexpr int kParts = 4;
  static constexpr size_t kRays = 16;  // at once: kept values stay in a core's second cache

  using Columns = std::array<std::vector<float>, 3>;
  struct Sample {
    size_t ray;
    double depth;
  };
  // Scratch memory of a part.
  struct Scratch {
    RaySums sums;
    std::vector<std::array<double, kPoseUnknowns>> by_poses;
    Columns points, moved, normals, logits, templates, by_logits, by_templates;
    std::vector<float> distances, by_distances;
    std::vector<Sample> samples;
    RayOpacity opacity;
  };
  struct Call;
  struct Track;

  void run_part(const Call& call, size_t begin, size_t end, FieldParts::Part& part, Scratch& scratch) const;
  void run_mattes(const Call& call, Track* tracks, size_t count, FieldParts::Part& part, Scratch& scratch) const;
  void refine_hits(const Call& call, Track* tracks, size_t count, FieldParts::Part& part, Scratch& scratch) const;
  void run_surface(const Call& call, const Track* tracks, size_t count, FieldParts::Part& part, Scratch& scratch) const;
  void surface_back(const Call& call, const Track* tracks, FieldParts::Part& part, Scratch& scratch) const;

  CutPlane cut_;
  double sharpness_;
  RayTermOptions options_;
  FieldParts parts_;
  std::vector<Scratch> scratches_;
};

}  // namespace maq::head
