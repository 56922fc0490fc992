// A head fitted to photos: stage 0 from template points (anchor_fit.h), then stage 1, Adam on codes and cameras with
// the pixels' losses along rays, until the time, the steps or the gain end.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/worker_threads.h"
#include "head/field/weight_bases.h"
#include "head/fit/anchor_fit.h"
#include "head/fit/ray_terms.h"

namespace maq::head {

// The objective is a negative log posterior: 1/2 |z|^2 for all codes, the focal length's prior, `anchor_weight` times
// the terms of stage 0, and the terms of rays (RayTermOptions). `ray_weight` rays count for each cell of the encoder:
// neighbouring rays say the same, and no term models light and shadow. With 0.3 (then the weight of a cell in stage 0),
// faces of held-out heads became 10 % worse in 5 s; with 0.03 they stay within 2 %.
struct HeadFitOptions {
  AnchorFitOptions anchors;
  RayTermOptions rays;
  double seconds = 5;  // for both stages; 0: stage 0 alone
  int max_steps = 300;
  int rays_per_step = 256;
  int first_side_px = 64, last_side_px = 128;  // of the crop as it is looked at, first and last
  double first_fraction = 0.5;                 // of the steps
  double ray_weight = 0.03;
  double anchor_weight = 0.5;  // both these and the field's template points are of the same cells: half of each
  // The most that a step changes a code by, or a camera: radians, and the same of its scale and focal length. They fall
  // to a tenth at the last step.
  double shape_rate = 0.03, colour_rate = 0.05, camera_rate = 0.003;
  // Fraction of the pixels that are held out of the fit. Every check_steps steps, they decide whether the head is
  // better than the best so far. After `patience` checks without a relative gain of min_gain, the fit continues from
  // the best head with half the rates; after the fourth time it ends.
  double held_out_fraction = 0.05;
  int check_steps = 10, patience = 3;
  double min_gain = 1e-3;
  uint64_t seed = 1;  // of the order of the rays, and of the held-out pixels
};

enum class HeadFitEnd {
  kNoCamera,   // no photo shows a head: the mean head
  kNoTime,     // no time for stage 1: the head of stage 0
  kSeconds,    // the time is over
  kSteps,      // max_steps are done
  kNoGain,     // the pixels held out gain no more
  kRefused,    // steps went wrong at any rate
  kCancelled,  // by the callback
};

// Terms of the whole objective, estimated from the held-out pixels; anchors, prior and focal are exact.
struct HeadLosses {
  double colour = 0, matte = 0, point = 0, anchors = 0, prior = 0;

  double total() const { return colour + matte + point + anchors + prior; }
};

struct HeadFitStats {
  HeadFitEnd end = HeadFitEnd::kNoCamera;
  int steps = 0, refused = 0, checks = 0;  // refused: of these steps
  double seconds = 0, anchor_seconds = 0;
  size_t rays = 0;                  // of all steps
  size_t pixels = 0, held_out = 0;  // of the last pyramid level
  size_t left_out = 0;              // points whose numbers were not finite
  HeadLosses first, last;           // of stage 0, of the result
};

// The head so far, while the callback runs.
struct HeadFitProgress {
  int steps = 0;
  double seconds = 0;
  double loss = 0;  // of the best head so far
  const FieldCodes& codes;
  const AnchorFit& start;
  const std::vector<PhotoFit>& photos;
};

// Called before each step of stage 1, from the thread that fits; false cancels.
using HeadFitCallback = std::function<bool(const HeadFitProgress&)>;

struct HeadFit {
  AnchorFit start;               // stage 0
  FieldCodes codes;              // the best that was found, as all below
  std::vector<PhotoFit> photos;  // as they were given
  FieldWeights weights;          // of `codes`
  HeadFitStats stats;
};

// Deterministic for options, as long as it is not time that ends it; the same for any number of threads. Memory grows
// with the photos (some 3 MB each), not with the steps. A step after which a number is not finite, or the loss far
// higher, is refused: the best head so far is taken up again with half the rates.
// Throws as fit_anchors() does.
HeadFit fit_head(const HeadPrior& prior, const std::vector<HeadPhoto>& photos, const HeadFitOptions& options,
                 WorkerThreads& threads, const HeadFitCallback& callback = {});

}  // namespace maq::head
