#include "scene/assembly/regression_store.h"

#include <algorithm>
#include <new>

namespace maq {

void RegressionStore::reserve(size_t more) {
  const size_t wanted = points_.size() + more;
  // Half again as many, or each photo would move all; but no more than there are.
  if (points_.capacity() < wanted) points_.reserve(std::min(slots_.size(), wanted + wanted / 2));
  while (chunks_.size() * kChunk < wanted) {
    auto* made = static_cast<DescriptorRegression*>(std::calloc(kChunk, sizeof(DescriptorRegression)));
    if (made == nullptr) throw std::bad_alloc();
    chunks_.emplace_back(made);
  }
}

}  // namespace maq
