#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <iostream>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "scene/format/block_codec.h"
#include "scene/format/scene_file.h"
#include "scene/format/scene_file_format.h"
#include "scene/format/scene_packing.h"
#include "scene/point_cloud.h"
#include "support/expect_error.h"
#include "support/samples/fitted_scene.h"
#include "support/temp_folder.h"

namespace {

using maq::SceneBlock;
using maq::SceneFileHead;

// A scene of two blocks, a few kilobytes.
std::string small_file(const TempFolder& folder,
                       maq::ScenePacking packing = {maq::PositionFormat::kUint16, maq::CoefficientFormat::kInt8, 0}) {
  maq::FittedPoints points = ball_over_a_floor(7);
  points.x[3] = 1e6f;
  const maq::Scene scene = make_scene(points, packing);
  EXPECT_EQ(scene.block_count, 2u);
  write_scene_file(scene, folder.file("small.maqs"));
  return read_text(folder.file("small.maqs"));
}

// Whatever a scene's file or memory holds may be used.
void use(const maq::Scene& scene) {
  uint32_t points = 0;
  for (uint32_t b = 0; b < scene.block_count; ++b) {
    const maq::FittedPoints part = decode_block(scene, scene.blocks[b]);
    points += uint32_t(part.count());
    for (const auto* values : {&part.x, &part.y, &part.z, &part.constant_terms, &part.linear_terms}) {
      for (const float value : *values) EXPECT_TRUE(std::isfinite(value));
    }
  }
  EXPECT_EQ(points, scene.points);
}

void open_and_use(const std::string& path) { use(maq::open_scene_file(path)); }

// From memory of exactly that length, so that the address sanitizer sees a read behind it.
void open_and_use_memory(const std::string& bytes) {
  const std::vector<char> copy(bytes.begin(), bytes.end());
  use(maq::open_scene_memory(copy.data(), copy.size()));
}

SceneFileHead head_of(const std::string& bytes) {
  SceneFileHead head;
  std::memcpy(&head, bytes.data(), sizeof head);
  return head;
}

// Makes all checks right, where sections lie in the file.
void repair(std::string& bytes) {
  SceneFileHead head = head_of(bytes);
  for (maq::SceneFileSpan& span : head.sections) {
    const uint64_t filled = maq::filled_up(span.bytes);
    if (span.offset > bytes.size() || filled < span.bytes || filled > bytes.size() - span.offset) continue;
    span.check = XXH3_64bits(bytes.data() + span.offset, size_t(filled));
  }
  head.head_check = XXH3_64bits(&head.file_bytes, sizeof head - offsetof(SceneFileHead, file_bytes));
  std::memcpy(bytes.data(), &head, sizeof head);
}

void write_over(const std::string& path, const std::string& bytes) {
  FILE* file = std::fopen(path.c_str(), "r+b");
  ASSERT_NE(file, nullptr);
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  std::fclose(file);
  ASSERT_EQ(truncate(path.c_str(), off_t(bytes.size())), 0);
}

bool is_refused(const std::function<void()>& open) {
  try {
    open();
  } catch (const maq::Error& error) {
    EXPECT_TRUE(error.status() == MAQ_ERROR_UNREADABLE || error.status() == MAQ_ERROR_UNSUPPORTED) << error.what();
    return true;
  }
  return false;
}
bool is_refused(const std::string& path) {
  return is_refused([&] { open_and_use(path); });
}
bool is_refused_from_memory(const std::string& bytes) {
  return is_refused([&] { open_and_use_memory(bytes); });
}

TEST(SceneFileDamage, EveryByteThatIsMissingIsNoticed) {
  TempFolder folder;
  const std::string bytes = small_file(folder), path = folder.file("small.maqs");
  open_and_use(path);
  for (size_t left = bytes.size(); left-- > 0;) {
    ASSERT_EQ(truncate(path.c_str(), off_t(left)), 0);
    ASSERT_TRUE(is_refused(path)) << left << " of " << bytes.size();
  }
  write_over(path, bytes + '\0');
  EXPECT_TRUE(is_refused(path));
  write_over(path, bytes + std::string(64, '\0'));
  EXPECT_TRUE(is_refused(path));
}

TEST(SceneFileDamage, EveryBitThatIsFlippedInMemoryIsNoticed) {
  TempFolder folder;
  std::string bytes = small_file(folder);
  for (size_t at = 0; at < bytes.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      bytes[at] = char(bytes[at] ^ (1 << bit));
      ASSERT_TRUE(is_refused_from_memory(bytes)) << "bit " << bit << " of byte " << at;
      bytes[at] = char(bytes[at] ^ (1 << bit));
    }
  }
  open_and_use_memory(bytes);
}

struct Attack {
  const char* text;  // of the sentence
  std::function<void(SceneFileHead&, SceneBlock*)> change;
};

void expect_refused(const Attack& attack, maq::ScenePacking packing, maq_status status = MAQ_ERROR_UNREADABLE) {
  TempFolder folder;
  std::string bytes = small_file(folder, packing);
  SceneFileHead head = head_of(bytes);
  std::vector<SceneBlock> blocks(head.blocks);
  const size_t offset = head.sections[maq::kBlocksSection].offset;
  std::memcpy(blocks.data(), bytes.data() + offset, blocks.size() * sizeof(SceneBlock));
  attack.change(head, blocks.data());
  std::memcpy(bytes.data(), &head, sizeof head);
  std::memcpy(bytes.data() + offset, blocks.data(), blocks.size() * sizeof(SceneBlock));
  repair(bytes);
  write_over(folder.file("small.maqs"), bytes);
  expect_error(status, attack.text, [&] { maq::open_scene_file(folder.file("small.maqs")); });
  expect_error(status, attack.text, [&] { maq::open_scene_memory(bytes.data(), bytes.size()); });
}

TEST(SceneFileDamage, HeadsThatLieAreRefusedThoughTheirChecksAreRight) {
  constexpr maq::ScenePacking kPacked = {maq::PositionFormat::kUint16, maq::CoefficientFormat::kInt8, 0};
  const Attack attacks[] = {
      {"claims 0 points", [](auto& head, auto*) { head.points = 0; }},
      {"section 1", [](auto& head, auto*) { head.points = 8; }},
      {"section 1", [](auto& head, auto*) { head.points = 30'000'000; }},
      {"claims", [](auto& head, auto*) { head.view_dependent = 8; }},
      {"section 3", [](auto& head, auto*) { head.view_dependent = 6; }},
      {"claims", [](auto& head, auto*) { head.blocks = 0; }},
      {"claims", [](auto& head, auto*) { head.blocks = 0xffffffff; }},
      {"section 0", [](auto& head, auto*) { head.blocks = 1; }},
      {"section 0", [](auto& head, auto*) { head.blocks = 7; }},
      {"in a way", [](auto& head, auto*) { head.position_format = 2; }},
      {"section 1", [](auto& head, auto*) { head.position_format = 0; }},
      {"in a way", [](auto& head, auto*) { head.coefficient_format = 255; }},
      {"section 2", [](auto& head, auto*) { head.coefficient_format = 1; }},
      {"in a way", [](auto& head, auto*) { head.zero[1] = 1; }},
      {"in a way", [](auto& head, auto*) { head.more_zeros[19] = 1; }},
      {"not finite", [](auto& head, auto*) { head.origin[1] = NAN; }},
      {"not finite", [](auto& head, auto*) { head.up[2] = -INFINITY; }},
      {"should have", [](auto& head, auto*) { head.file_bytes += 64; }},
      {"should have", [](auto& head, auto*) { head.file_bytes = uint64_t(1) << 63; }},
      {"has a head of 64 bytes", [](auto& head, auto*) { head.head_bytes = 64; }},
      {"section 1", [](auto& head, auto*) { head.sections[1].offset = 0; }},
      {"section 1", [](auto& head, auto*) { head.sections[1].offset += 1; }},
      {"section 2", [](auto& head, auto*) { head.sections[2].offset = ~uint64_t(0) - 63; }},
      {"section 2", [](auto& head, auto*) { head.sections[2].bytes = ~uint64_t(0); }},
      {"section 3", [](auto& head, auto*) { head.sections[3].bytes -= 1; }},
  };
  for (const Attack& attack : attacks) expect_refused(attack, kPacked);
  expect_refused({"at most", [](auto& head, auto*) { head.points = 30'000'001; }}, kPacked, MAQ_ERROR_UNSUPPORTED);
  expect_refused({"version 2", [](auto& head, auto*) { head.version = 2; }}, kPacked, MAQ_ERROR_UNSUPPORTED);
}

TEST(SceneFileDamage, BlocksThatLieAreRefusedThoughTheirChecksAreRight) {
  const Attack attacks[] = {
      {"block 0", [](auto&, auto* blocks) { blocks[0].first = 1; }},
      {"block 0", [](auto&, auto* blocks) { blocks[0].count = 0; }},
      {"block 0", [](auto&, auto* blocks) { blocks[0].count = 1025; }},
      {"block 0", [](auto&, auto* blocks) { blocks[0].count = ~0u; }},
      {"block 1", [](auto&, auto* blocks) { blocks[0].count += 1; }},
      {"has blocks of", [](auto&, auto* blocks) { blocks[1].count += 1; }},
      {"has blocks of", [](auto&, auto* blocks) { blocks[1].view_dependent -= 1; }},
      {"block 0", [](auto&, auto* blocks) { blocks[0].view_dependent = blocks[0].count + 1; }},
      {"block 1", [](auto&, auto* blocks) { blocks[0].view_dependent -= 1; }},
      {"block 0", [](auto&, auto* blocks) { blocks[0].first_view_dependent = ~0u; }},
      {"block 1", [](auto&, auto* blocks) { blocks[1].first = 0; }},
      {"block 1", [](auto&, auto* blocks) { blocks[1].first_view_dependent += 1; }},
      {"block 1: its bounds", [](auto&, auto* blocks) { blocks[1].low[2] = NAN; }},
      {"block 1: its bounds", [](auto&, auto* blocks) { blocks[1].high[0] = INFINITY; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].low[0] = blocks[0].high[0] + 1; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].low[1] = -3e30f; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].position_step[0] = NAN; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].position_step[0] = -1; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].position_step[0] *= 2; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].constant_middle[7] = NAN; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].constant_step[0] = INFINITY; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].constant_step[0] = -1; }},
      {"block 0: its bounds", [](auto&, auto* blocks) { blocks[0].constant_step[0] = 3e28f; }},
      {"block 1: its bounds", [](auto&, auto* blocks) { blocks[1].linear_step[47] = NAN; }},
      {"block 1: its bounds", [](auto&, auto* blocks) { blocks[1].linear_step[46] = 1e35f; }},
      {"block 1: its bounds", [](auto&, auto* blocks) { blocks[1].linear_step[45] = -1; }},
  };
  for (const Attack& attack : attacks)
    expect_refused(attack, {maq::PositionFormat::kUint16, maq::CoefficientFormat::kInt8, 0});
}

TEST(SceneFileDamage, NumbersThatAreNotFiniteAreRefused) {
  for (const maq::SceneFileSection section :
       {maq::kPositionsSection, maq::kConstantTermsSection, maq::kLinearTermsSection}) {
    for (const float value : {float(NAN), INFINITY, -3e30f}) {
      TempFolder folder;
      std::string bytes = small_file(folder, {maq::PositionFormat::kFloat32, maq::CoefficientFormat::kFloat32, 0});
      const maq::SceneFileSpan span = head_of(bytes).sections[section];
      std::memcpy(bytes.data() + span.offset + span.bytes - sizeof value, &value, sizeof value);
      repair(bytes);
      write_over(folder.file("small.maqs"), bytes);
      expect_error(MAQ_ERROR_UNREADABLE, "not finite", [&] { open_and_use(folder.file("small.maqs")); });
    }
  }
}

// Whatever is written into a file whose checks are then made right: refused, or harmless.
TEST(SceneFileDamage, RandomChangesWithRightChecksAreRefusedOrHarmless) {
  std::mt19937 random(11);
  const uint32_t nasty[] = {0,          1,          2,          6,          7,          8,          0x7f,
                            0xff,       1024,       1025,       65535,      0x7fffffff, 0x80000000, 0xffffffff,
                            0x7f800000, 0xff800000, 0x7fc00000, 0x7f7fffff, 0x00000001, 0x7149f2ca};
  int refused = 0, opened = 0;
  for (const auto positions : {maq::PositionFormat::kFloat32, maq::PositionFormat::kUint16}) {
    for (const auto kind :
         {maq::CoefficientFormat::kFloat32, maq::CoefficientFormat::kInt16, maq::CoefficientFormat::kInt8}) {
      TempFolder folder;
      const std::string path = folder.file("small.maqs"), whole = small_file(folder, {positions, kind, 0});
      for (int round = 0; round < 2'000; ++round) {
        std::string bytes = whole;
        for (uint32_t change = 0; change <= random() % 3; ++change) {
          // Half of them in the head and the blocks, which decide where everything is.
          const size_t span = random() % 2 == 0 ? sizeof(SceneFileHead) + 2 * sizeof(SceneBlock) : bytes.size();
          const size_t at = random() % (span / 4) * 4;
          const uint32_t value = random() % 2 == 0 ? uint32_t(random()) : nasty[random() % std::size(nasty)];
          std::memcpy(bytes.data() + at, &value, random() % 2 == 0 ? 1 : 4);
        }
        if (random() % 8 == 0) bytes.resize(random() % (bytes.size() + 1));
        if (bytes.size() >= sizeof(SceneFileHead)) {
          // The size too, so that more than the size is checked.
          const uint64_t size = bytes.size();
          if (random() % 2 == 0) std::memcpy(bytes.data() + offsetof(SceneFileHead, file_bytes), &size, sizeof size);
          repair(bytes);
        }
        write_over(path, bytes);
        const bool is_file_refused = is_refused(path);
        EXPECT_EQ(is_refused_from_memory(bytes), is_file_refused);
        ++(is_file_refused ? refused : opened);
      }
    }
  }
  std::cout << refused << " refused, " << opened << " opened\n";
  EXPECT_GT(refused, 3'000);
  EXPECT_GT(opened, 1'000);
}

}  // namespace
