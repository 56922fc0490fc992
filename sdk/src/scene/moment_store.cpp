#include "scene/moment_store.h"

#include <algorithm>

namespace maq {

void MomentStore::reserve(size_t more) {
  const size_t wanted = points_.size() + more;
  // Half again as many, or each photo would move all; but no more than there are.
  if (points_.capacity() < wanted) points_.reserve(std::min(places_.size(), wanted + wanted / 2));
  while (chunks_.size() * kChunk < wanted) chunks_.push_back(std::make_unique<ViewMoments[]>(kChunk));
}

}  // namespace maq
