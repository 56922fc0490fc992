#include "core/files/checked_bytes.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

// Larger ones come of no training, and products of some of them are not finite.
constexpr float kMaxStoredNumber = 1e6f;

}  // namespace

void CheckedBytes::check_start(const char (&magic)[8], uint32_t version, size_t head_bytes, const char* kind,
                               const char* remedy) const {
  FileStart start;
  if (left_ < head_bytes) fail(" is too short to be ", kind, ": ", left_, " bytes.");
  std::memcpy(&start, bytes_, sizeof start);
  if (std::memcmp(start.magic, magic, sizeof start.magic) != 0) fail(" is not ", kind, ".");
  if (start.version != version) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name_, " is ", kind, " of version ", start.version, "; this SDK reads version ",
                version, ". ", remedy);
  }
  if (start.file_bytes != left_) {
    fail(" has ", left_, " bytes, but should have ", start.file_bytes, ": it is truncated or damaged; copy it again.");
  }
  if (start.head_bytes != head_bytes || start.check != XXH3_64bits(bytes_ + kCheckedFrom, left_ - kCheckedFrom)) {
    fail(" is damaged; copy it again.");
  }
}

const uint8_t* CheckedBytes::take(size_t count) {
  require_left(count, 1);
  const uint8_t* const taken = bytes_;
  bytes_ += count;
  left_ -= count;
  return taken;
}

void CheckedBytes::check_floats(const float* values, size_t count) const {
  // False for NaN.
  if (!std::all_of(values, values + count, [](float value) { return std::abs(value) <= kMaxStoredNumber; })) {
    fail(" has numbers that are not finite, or too large; make it again.");
  }
}

std::vector<float> CheckedBytes::floats(size_t count) {
  require_left(count, sizeof(float));
  std::vector<float> values(count);
  const uint8_t* const from = take(count * sizeof(float));
  if (count > 0) std::memcpy(values.data(), from, count * sizeof(float));
  check_floats(values.data(), count);
  return values;
}

void CheckedBytes::end() const {
  if (left_ > 0) fail(" has ", left_, " bytes that belong to nothing.");
}

void sign_file(std::vector<uint8_t>& file, size_t head_bytes, const char (&magic)[8], uint32_t version) {
  FileStart start{};
  std::memcpy(start.magic, magic, sizeof start.magic);
  start.version = version;
  start.head_bytes = uint32_t(head_bytes);
  start.file_bytes = file.size();
  std::memcpy(file.data(), &start, sizeof start);
  start.check = XXH3_64bits(file.data() + kCheckedFrom, file.size() - kCheckedFrom);
  std::memcpy(file.data(), &start, sizeof start);
}

}  // namespace maq
