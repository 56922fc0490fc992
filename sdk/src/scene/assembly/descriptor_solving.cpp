#include "scene/assembly/descriptor_solving.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq {
namespace {

// Weight of the ridge regression, as in NPBG++ (arXiv 2203.13318).
constexpr double kAlpha = 1;

struct Solved {
  float beta[kBasis][kFeatures];
  float view_dependence;
  bool is_singular;
};

// The view-dependence of a descriptor: the root of the mean square of |(h - mean h) beta| over the photos that saw the
// point. The triangle R has the scatter of h as R^T R, so the sum of squares equals the one of R beta.
float view_dependence_of(const DescriptorRegression& regression, const float beta[kBasis][kFeatures]) {
  double sum = 0;
  const float* row = regression.triangle;
  for (int i = 0; i < kBasis; row += kBasis - i, ++i) {
    double values[kFeatures] = {};
    for (int j = i; j < kBasis; ++j) {
      for (int c = 0; c < kFeatures; ++c) values[c] += double(row[j - i]) * double(beta[j][c]);
    }
    for (const double value : values) sum += value * value;
  }
  const double view_dependence = std::sqrt(sum / regression.views);
  return float(std::min(view_dependence, double(std::numeric_limits<float>::max())));
}

template <class Value>
void append(std::vector<Value>& to, const Value* from, size_t count) {
  to.insert(to.end(), from, from + count);
}

}  // namespace

void solve_descriptors(RegressionStore& regressions, const PointPositions& positions, WorkerThreads& threads,
                       bool forgets, FittedPoints& made) {
  const size_t count = regressions.count();
  // Reserved at once, or each array would be there twice while it grows; pages not yet written take no memory.
  for (std::vector<float>* array : {&made.x, &made.y, &made.z, &made.view_dependence}) array->reserve(count);
  made.views.reserve(count);
  made.constant_terms.reserve(count * kFeatures);
  made.linear_terms.reserve(count * kBasis * kFeatures);

  constexpr size_t kBatch = 10'000, kTask = 1'000;
  static_assert(RegressionStore::kChunk % kBatch == 0);
  std::vector<Solved> solved(std::min(count, kBatch));
  for (size_t first = 0; first < count; first += kBatch) {
    const size_t size = std::min(kBatch, count - first), end = first + size;
    threads.run((size + kTask - 1) / kTask, [&](size_t task, int) {
      for (size_t i = task * kTask; i < std::min(size, (task + 1) * kTask); ++i) {
        const DescriptorRegression& known = regressions.at(first + i);
        Solved& descriptor = solved[i];
        descriptor.is_singular = solve_descriptor(known, kAlpha, descriptor.beta) == DescriptorKind::kSingular;
        descriptor.view_dependence = view_dependence_of(known, descriptor.beta);
      }
    });
    for (size_t i = 0; i < size; ++i) {
      const uint32_t point = regressions.points()[first + i];
      const DescriptorRegression& known = regressions.at(first + i);
      made.x.push_back(positions.x[point]);
      made.y.push_back(positions.y[point]);
      made.z.push_back(positions.z[point]);
      append(made.constant_terms, known.mean_y, kFeatures);
      append(made.linear_terms, solved[i].beta[0], kBasis * kFeatures);
      made.view_dependence.push_back(solved[i].view_dependence);
      made.views.push_back(known.views);
      made.singular += solved[i].is_singular ? 1 : 0;
    }
    if (forgets && (end == count || end % RegressionStore::kChunk == 0))
      regressions.forget_chunk((end - 1) / RegressionStore::kChunk);
  }
}

}  // namespace maq
