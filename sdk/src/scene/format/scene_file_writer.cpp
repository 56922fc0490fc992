#include <xxhash.h>

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "scene/format/scene.h"
#include "scene/format/scene_file.h"
#include "scene/format/scene_file_format.h"

namespace maq {
namespace {

// One section after the other, each filled up with zeros.
class SectionWriter {
 public:
  SectionWriter(AtomicFile& file, SceneFileHead& head) : file_(file), head_(head) {}

  void begin() {
    XXH3_64bits_reset(&hash_);
    offset_ = file_.size_bytes();
  }

  void add(const void* bytes, size_t count) {
    if (count == 0) return;  // `bytes` may be null
    XXH3_64bits_update(&hash_, bytes, count);
    file_.append(bytes, count);
  }

  void end(SceneFileSection section) {
    const uint64_t bytes = file_.size_bytes() - offset_;
    constexpr char kZeros[kSceneFileAlignment] = {};
    add(kZeros, size_t(filled_up(bytes) - bytes));
    head_.sections[section] = {offset_, bytes, XXH3_64bits_digest(&hash_)};
  }

  void write(SceneFileSection section, const void* bytes, size_t count) {
    begin();
    add(bytes, count);
    end(section);
  }

 private:
  AtomicFile& file_;
  SceneFileHead& head_;
  XXH3_state_t hash_;
  uint64_t offset_ = 0;
};

}  // namespace

void write_scene_file(const Scene& scene, const std::string& path) {
  if (scene.points == 0 || scene.block_count == 0) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " is not written: the scene has no points.");
  }
  SceneFileHead head{};
  std::memcpy(head.magic, kSceneFileMagic, sizeof head.magic);
  head.version = kSceneFileVersion;
  head.head_bytes = sizeof head;
  std::copy_n(scene.origin.begin(), 3, head.origin);
  std::copy_n(scene.up.begin(), 3, head.up);
  std::copy_n(scene.background.begin(), 3, head.background);
  head.points = scene.points;
  head.view_dependent = scene.view_dependent;
  head.blocks = scene.block_count;
  head.position_format = uint8_t(scene.position_format);
  head.coefficient_format = uint8_t(scene.coefficient_format);
  std::copy_n(scene.networks_sha256.begin(), sizeof head.networks_sha256, head.networks_sha256);

  AtomicFile file(path);
  file.append(&head, sizeof head);  // is written again when its checks are known
  SectionWriter sections(file, head);
  sections.write(kBlocksSection, scene.blocks, blocks_bytes(scene));
  sections.write(kPositionsSection, scene.positions, positions_bytes(scene));
  sections.write(kConstantTermsSection, scene.constant_terms, constant_terms_bytes(scene));
  sections.write(kLinearTermsSection, scene.linear_terms, linear_terms_bytes(scene));
  head.file_bytes = file.size_bytes();
  constexpr size_t kChecked = offsetof(SceneFileHead, file_bytes);
  head.head_check = XXH3_64bits(&head.file_bytes, sizeof head - kChecked);
  file.overwrite(0, &head, sizeof head);
  file.commit();
}

}  // namespace maq
