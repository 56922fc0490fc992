#include "scene/build/descriptor_solving.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq {
namespace {

// Of the ridge regression; NPBG++ (arXiv 2203.13318) has the same.
constexpr double kAlpha = 1;

struct Solved {
  float slope[kBasis][kFeatures];
  float variation;
  bool is_singular;
};

// How far the look moves from its mean over the photos that saw the point: the root of the mean square of
// |(h - mean h) beta|. The triangle R has the scatter of h as R^T R, so that the sum of squares is that of R beta.
float variation_of(const ViewMoments& moments, const float slope[kBasis][kFeatures]) {
  double sum = 0;
  const float* row = moments.triangle;
  for (int i = 0; i < kBasis; row += kBasis - i, ++i) {
    double values[kFeatures] = {};
    for (int j = i; j < kBasis; ++j) {
      for (int c = 0; c < kFeatures; ++c) values[c] += double(row[j - i]) * double(slope[j][c]);
    }
    for (const double value : values) sum += value * value;
  }
  const double variation = std::sqrt(sum / moments.views);
  return float(std::min(variation, double(std::numeric_limits<float>::max())));
}

template <class Value>
void append(std::vector<Value>& to, const Value* from, size_t count) {
  to.insert(to.end(), from, from + count);
}

}  // namespace

void solve_looks(MomentStore& moments, const PointPlaces& places, WorkerThreads& threads, bool forgets,
                 ModelledPoints& made) {
  const size_t count = moments.count();
  // Asked for at once, or each array would be there twice while it grows; what is not written yet takes no memory.
  for (std::vector<float>* array : {&made.x, &made.y, &made.z, &made.variations}) array->reserve(count);
  made.views.reserve(count);
  made.means.reserve(count * kFeatures);
  made.slopes.reserve(count * kBasis * kFeatures);

  constexpr size_t kBatch = 10'000, kTask = 1'000;
  static_assert(MomentStore::kChunk % kBatch == 0);
  std::vector<Solved> solved(std::min(count, kBatch));
  for (size_t first = 0; first < count; first += kBatch) {
    const size_t size = std::min(kBatch, count - first), end = first + size;
    threads.run((size + kTask - 1) / kTask, [&](size_t task, int) {
      for (size_t i = task * kTask; i < std::min(size, (task + 1) * kTask); ++i) {
        const ViewMoments& known = moments.at(first + i);
        Solved& look = solved[i];
        look.is_singular = solve_look(known, kAlpha, look.slope) == LookKind::kSingular;
        look.variation = variation_of(known, look.slope);
      }
    });
    for (size_t i = 0; i < size; ++i) {
      const uint32_t point = moments.points()[first + i];
      const ViewMoments& known = moments.at(first + i);
      made.x.push_back(places.x[point]);
      made.y.push_back(places.y[point]);
      made.z.push_back(places.z[point]);
      append(made.means, known.mean_y, kFeatures);
      append(made.slopes, solved[i].slope[0], kBasis * kFeatures);
      made.variations.push_back(solved[i].variation);
      made.views.push_back(known.views);
      made.singular += solved[i].is_singular ? 1 : 0;
    }
    if (forgets && (end == count || end % MomentStore::kChunk == 0))
      moments.forget_chunk((end - 1) / MomentStore::kChunk);
  }
}

}  // namespace maq
