// A batch for the field engine split among threads, so that sums over points come out the same each time.
#pragma once

#include <cstddef>
#include <vector>

#include "core/worker_threads.h"
#include "head/field/field_engine.h"

namespace maq::head {

// Each part has its own points, workspace and gradient, and the gradients are added in the order of the parts: the
// result depends on how many parts there are, not on which thread takes which of them or how many threads there are.
class FieldParts {
 public:
  struct Part {
    size_t begin = 0, end = 0;  // of the items
    FieldWorkspace workspace;
    FieldWeights gradient;  // 0 at the beginning of each run
  };

  // As many parts as threads is best. Throws MAQ_ERROR_INVALID_ARGUMENT unless there are 1 to kMaxThreads, and as
  // check_field_shape() does.
  FieldParts(const FieldShape& shape, int parts);

  int count() const { return int(parts_.size()); }
  Part& part(int index) { return parts_[size_t(index)]; }

  // Splits `items` (rays, say) into neighbouring ranges, each but the last a multiple of `whole` long, and calls
  // work(part) for each that is not empty; its exceptions are passed on. Work that goes through its range in batches of
  // a few hundred points keeps them in the core's second cache.
  template <class Work>
  void run(WorkerThreads& threads, size_t items, size_t whole, Work&& work) {
    begin(items, whole);
    threads.run(parts_.size(), [&](size_t index, int) {
      Part& part = parts_[index];
      part.gradient.set_zero();
      if (part.begin < part.end) work(part);
    });
  }

  // Adds the parts' gradients of the last run, one part after the other.
  void add_gradients(FieldWeights& sum) const;

 private:
  void begin(size_t items, size_t whole);

  std::vector<Part> parts_;
};

}  // namespace maq::head
