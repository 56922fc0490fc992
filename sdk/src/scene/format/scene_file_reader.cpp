#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/files/file.h"
#include "core/files/file_calls.h"
#include "scene/format/scene.h"
#include "scene/format/scene_file.h"
#include "scene/format/scene_file_format.h"
#include "scene/point_cloud.h"

namespace maq {
namespace {

constexpr size_t kReadAtOnce = 1 << 20;  // a multiple of the alignment, and of a float
// A little more than make_scene accepts, since steps are rounded.
constexpr double kMaxStored = 2e30;

bool is_sound(double value) { return std::abs(value) <= kMaxStored; }  // false for NaN
bool are_sound(const float* values, size_t count) {
  return std::all_of(values, values + count, [](float value) { return is_sound(value); });
}
bool are_zero(const uint8_t* bytes, size_t count) {
  return std::all_of(bytes, bytes + count, [](uint8_t byte) { return byte == 0; });
}

// The head and the sections of a scene, from a file or from memory.
class SceneFileReader {
 public:
  explicit SceneFileReader(const std::string& path);
  SceneFileReader(const void* bytes, size_t count);

  const SceneFileHead& head() const { return head_; }
  bool is_file() const { return memory_ == nullptr; }

  // Reads a section with the zeros behind it and compares the check; `use` gets its bytes, part by part.
  template <class Use>
  void read(SceneFileSection section, Use&& use) const {
    const SceneFileSpan& span = head_.sections[section];
    // Floats, so that `use` may look at them as such.
    std::vector<float> part((size_t(std::min<uint64_t>(kReadAtOnce, filled_up(span.bytes))) + 3) / sizeof(float));
    XXH3_state_t hash;
    XXH3_64bits_reset(&hash);
    for (uint64_t done = 0; done < filled_up(span.bytes);) {
      const size_t count = size_t(std::min<uint64_t>(kReadAtOnce, filled_up(span.bytes) - done));
      read_at(span.offset + done, part.data(), count);
      XXH3_64bits_update(&hash, part.data(), count);
      use(part.data(), size_t(std::min<uint64_t>(count, span.bytes - std::min(done, span.bytes))), size_t(done));
      done += count;
    }
    if (XXH3_64bits_digest(&hash) != span.check)
      fail(" is damaged at byte ", span.offset, " or behind; copy it again.");
  }

  // To memory that has room for it.
  void read_to(SceneFileSection section, void* to) const {
    read(section, [&](const float* part, size_t count, size_t done) {
      std::memcpy(static_cast<uint8_t*>(to) + done, part, count);
    });
  }

  std::shared_ptr<const uint8_t> map() const;

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(MAQ_ERROR_UNREADABLE, path_, parts...);
  }

 private:
  void read_at(uint64_t offset, void* bytes, size_t count) const;
  void read_head(uint64_t size_bytes);
  void check_head(uint64_t size_bytes) const;

  std::string path_;  // begins each sentence
  UniqueFd file_;
  const char* memory_ = nullptr;  // in place of the file
  SceneFileHead head_{};
};

SceneFileReader::SceneFileReader(const std::string& path) : path_(path) {
  OpenFile file = open_file(path);
  file_ = std::move(file.fd);
  read_head(file.size_bytes);
}

SceneFileReader::SceneFileReader(const void* bytes, size_t count)
    : path_("The scene in memory"), memory_(static_cast<const char*>(bytes)) {
  read_head(count);
}

void SceneFileReader::read_head(uint64_t size_bytes) {
  if (size_bytes < sizeof head_) fail(" is too short for a scene: ", size_bytes, " bytes.");
  read_at(0, &head_, sizeof head_);
  check_head(size_bytes);
}

void SceneFileReader::read_at(uint64_t offset, void* bytes, size_t count) const {
  if (memory_ != nullptr) {
    std::memcpy(bytes, memory_ + offset, count);  // check_head() compared the sizes
    return;
  }
  auto* to = static_cast<char*>(bytes);
  while (count > 0) {
    const ptrdiff_t got = maq::read_at(file_.get(), offset, to, count);
    if (got <= 0) fail(" cannot be read at byte ", offset, "; did it change meanwhile?");
    to += got;
    offset += uint64_t(got);
    count -= size_t(got);
  }
}

void SceneFileReader::check_head(uint64_t size_bytes) const {
  if (std::memcmp(head_.magic, kSceneFileMagic, sizeof head_.magic) != 0) fail(" is not a scene (.maqs).");
  if (head_.version != kSceneFileVersion) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path_, " is a scene of version ", head_.version, "; this SDK reads version ",
                kSceneFileVersion, ". Build the scene again.");
  }
  constexpr size_t kChecked = offsetof(SceneFileHead, file_bytes);
  if (head_.head_bytes != sizeof head_) {
    fail(" has a head of ", head_.head_bytes, " bytes, where version ", kSceneFileVersion, " has ", sizeof head_,
         ": it is damaged, or of an SDK before the first release. Build the scene again.");
  }
  if (head_.head_check != XXH3_64bits(&head_.file_bytes, sizeof head_ - kChecked)) {
    fail(" is damaged in its first ", sizeof head_, " bytes; copy it again.");
  }
  if (head_.file_bytes != size_bytes) {
    fail(" has ", size_bytes, " bytes, but should have ", head_.file_bytes,
         ": it is truncated or damaged; copy it again.");
  }
  // The checks below fail only for malicious files, or for a defective writer.
  const bool has_kinds = head_.position_format <= uint8_t(PositionFormat::kUint16) &&
                         head_.coefficient_format <= uint8_t(CoefficientFormat::kInt8) &&
                         are_zero(head_.zero, sizeof head_.zero) && are_zero(head_.more_zeros, sizeof head_.more_zeros);
  if (!has_kinds) fail(" stores its numbers in a way that version ", kSceneFileVersion, " does not have.");
  if (head_.points > kMaxPoints) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path_, " has ", head_.points, " points; at most ", kMaxPoints, " can be shown.");
  }
  if (head_.points == 0 || head_.blocks == 0 || head_.blocks > head_.points || head_.view_dependent > head_.points) {
    fail(" claims ", head_.points, " points, ", head_.view_dependent, " of them view-dependent, in ", head_.blocks,
         " blocks: that cannot be.");
  }
  for (const double* vector : {head_.origin, head_.up}) {
    if (!std::isfinite(vector[0]) || !std::isfinite(vector[1]) || !std::isfinite(vector[2])) {
      fail(" has an origin or a direction of up that is not finite.");
    }
  }
  for (const float part : head_.background) {
    if (!(part >= 0 && part <= 1)) fail(" has a background colour of ", part, ", which is not 0 to 1.");
  }
  const uint64_t coordinate = size_bytes_of(PositionFormat(head_.position_format));
  const uint64_t coefficient = size_bytes_of(CoefficientFormat(head_.coefficient_format));
  const uint64_t bytes[kSceneFileSections] = {head_.blocks * uint64_t(sizeof(SceneBlock)),
                                              head_.points * 3 * coordinate, head_.points * kFeatures * coefficient,
                                              head_.view_dependent * kLinearTerms * coefficient};
  uint64_t offset = sizeof head_;
  for (int s = 0; s < kSceneFileSections; ++s) {
    if (head_.sections[s].offset != offset || head_.sections[s].bytes != bytes[s]) {
      fail(", section ", s, ": is said to have ", head_.sections[s].bytes, " bytes from ", head_.sections[s].offset,
           " on, but should have ", bytes[s], " from ", offset, " on.");
    }
    offset += filled_up(bytes[s]);
  }
  if (offset != size_bytes) fail(" has ", size_bytes - offset, " bytes that belong to nothing.");
}

std::shared_ptr<const uint8_t> SceneFileReader::map() const {
  const size_t bytes = size_t(head_.file_bytes);
  std::shared_ptr<const uint8_t> at;
  if (bytes == head_.file_bytes) at = map_file(file_.get(), bytes);
  if (at == nullptr) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, path_, " cannot be mapped into memory: it has ", head_.file_bytes, " bytes.");
  }
  return at;
}

// Checks what the renderer relies on: blocks follow each other without gaps, and decoded numbers are finite.
void check_blocks(const SceneFileReader& file, const std::vector<SceneBlock>& blocks) {
  const SceneFileHead& head = file.head();
  const double max_constant = head.coefficient_format == uint8_t(CoefficientFormat::kInt8)    ? 128
                              : head.coefficient_format == uint8_t(CoefficientFormat::kInt16) ? 32768
                                                                                              : 1;
  const double max_position = head.position_format == uint8_t(PositionFormat::kUint16) ? 65535 : 0;
  uint64_t points = 0, view_dependent = 0;
  for (size_t b = 0; b < blocks.size(); ++b) {
    const SceneBlock& block = blocks[b];
    if (block.first != points || block.first_view_dependent != view_dependent || block.count == 0 ||
        block.count > SceneBlock::kMaxPoints || block.view_dependent > block.count) {
      file.fail(", block ", b, ": ", block.count, " points from ", block.first, " on, ", block.view_dependent,
                " view-dependent from ", block.first_view_dependent, " on, after ", points, " and ", view_dependent,
                ".");
    }
    points += block.count;
    view_dependent += block.view_dependent;
    bool is_right = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double reached = block.low[axis] + max_position * block.position_step[axis];
      is_right &= is_sound(block.low[axis]) && is_sound(block.high[axis]) && block.position_step[axis] >= 0 &&
                  is_sound(block.position_step[axis]) && reached <= block.high[axis];
    }
    for (int c = 0; c < kFeatures; ++c) {
      is_right &= is_sound(std::abs(double(block.constant_middle[c])) + max_constant * block.constant_step[c]) &&
                  block.constant_step[c] >= 0;
    }
    for (const float step : block.linear_step) is_right &= step >= 0 && is_sound(max_constant * step);
    if (!is_right) file.fail(", block ", b, ": its bounds or steps are not finite, or do not hold its points.");
  }
  if (points != head.points || view_dependent != head.view_dependent) {
    file.fail(" has blocks of ", points, " points, ", view_dependent, " of them view-dependent, but claims ",
              head.points, " and ", head.view_dependent, ".");
  }
}

struct StoredArrays {
  std::vector<SceneBlock> blocks;  // copied: checked values must not change
  std::shared_ptr<const uint8_t> mapping;
  std::vector<uint8_t> memory;
};

// Checks all that `file` holds. Its arrays are mapped where it is a file, else copied.
Scene open_checked(const SceneFileReader& file) {
  const SceneFileHead& head = file.head();
  const auto arrays = std::make_shared<StoredArrays>();
  arrays->blocks.resize(head.blocks);
  file.read_to(kBlocksSection, arrays->blocks.data());
  check_blocks(file, arrays->blocks);

  constexpr SceneFileSection kArrays[3] = {kPositionsSection, kConstantTermsSection, kLinearTermsSection};
  const uint64_t begin = head.sections[kPositionsSection].offset;
  if (!file.is_file()) arrays->memory.resize(size_t(head.file_bytes - begin));
  for (const SceneFileSection section : kArrays) {
    const bool are_floats = section == kPositionsSection
                                ? PositionFormat(head.position_format) == PositionFormat::kFloat32
                                : CoefficientFormat(head.coefficient_format) == CoefficientFormat::kFloat32;
    file.read(section, [&](const float* part, size_t bytes, size_t done) {
      if (are_floats && !are_sound(part, bytes / sizeof(float))) {
        file.fail(" has positions or coefficients that are not finite; build the scene again.");
      }
      // The part that was checked, whatever happens to the caller's bytes meanwhile.
      if (!file.is_file()) {
        std::memcpy(arrays->memory.data() + (head.sections[section].offset - begin) + done, part, bytes);
      }
    });
  }
  if (file.is_file()) arrays->mapping = file.map();
  const auto at = [&](SceneFileSection section) -> const void* {
    const uint64_t offset = head.sections[section].offset;
    return file.is_file() ? arrays->mapping.get() + offset : arrays->memory.data() + (offset - begin);
  };

  Scene scene;
  std::copy_n(head.origin, 3, scene.origin.begin());
  std::copy_n(head.up, 3, scene.up.begin());
  std::copy_n(head.background, 3, scene.background.begin());
  scene.position_format = PositionFormat(head.position_format);
  scene.coefficient_format = CoefficientFormat(head.coefficient_format);
  scene.points = head.points;
  scene.view_dependent = head.view_dependent;
  scene.block_count = head.blocks;
  scene.blocks = arrays->blocks.data();
  scene.positions = at(kPositionsSection);
  scene.constant_terms = at(kConstantTermsSection);
  scene.linear_terms = at(kLinearTermsSection);
  std::copy_n(head.networks_sha256, scene.networks_sha256.size(), scene.networks_sha256.begin());
  scene.owner = arrays;
  return scene;
}

}  // namespace

Scene open_scene_file(const std::string& path) { return open_checked(SceneFileReader(path)); }

Scene open_scene_memory(const void* bytes, size_t count) { return open_checked(SceneFileReader(bytes, count)); }

}  // namespace maq
