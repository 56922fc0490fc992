#include "head/field/field_parts.h"

#include <algorithm>

#include "core/error.h"

namespace maq::head {

FieldParts::FieldParts(const FieldShape& shape, int parts) {
  if (parts < 1 || parts > kMaxThreads) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Parts of a batch are ", parts, ", but must be 1 to ", kMaxThreads, ".");
  }
  parts_.reserve(size_t(parts));
  for (int i = 0; i < parts; ++i) parts_.push_back({0, 0, {}, FieldWeights(shape)});
}

void FieldParts::begin(size_t items, size_t whole) {
  whole = std::max<size_t>(whole, 1);
  const size_t wholes = items / whole + (items % whole != 0);
  const size_t each = wholes / parts_.size(), rest = wholes % parts_.size();
  size_t done = 0;
  for (size_t i = 0; i < parts_.size(); ++i) {
    parts_[i].begin = std::min(items, done * whole);
    done += each + (i < rest);
    parts_[i].end = done == wholes ? items : done * whole;
  }
}

void FieldParts::add_gradients(FieldWeights& sum) const {
  for (const Part& part : parts_) sum.add(part.gradient);
}

}  // namespace maq::head
