// The bytes of a scene file (.maqs). Numbers are little-endian, as on every machine that the SDK runs on.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/rounding.h"
#include "scene/format/scene.h"

namespace maq {

inline constexpr char kSceneFileMagic[8] = {'M', 'A', 'Q', 'S', 'C', 'N', '\r', '\n'};
inline constexpr uint32_t kSceneFileVersion = 1;
inline constexpr uint64_t kSceneFileAlignment = 64;

// In this order, one after the other, each at a multiple of 64 bytes and filled up to one with zeros.
enum SceneFileSection {
  kBlocksSection,         // SceneBlock [blocks]
  kPositionsSection,      // as Scene::positions
  kConstantTermsSection,  // as Scene::constant_terms
  kLinearTermsSection,    // as Scene::linear_terms
  kSceneFileSections
};

struct SceneFileSpan {
  uint64_t offset;  // from the start of the file
  uint64_t bytes;   // without the zeros that fill it up
  uint64_t check;   // 64-bit XXH3 of it and those zeros
};

struct SceneFileHead {
  char magic[8];
  uint32_t version;
  uint32_t head_bytes;  // of this struct
  uint64_t head_check;  // 64-bit XXH3 of the rest of this struct
  uint64_t file_bytes;
  double origin[3], up[3];
  uint32_t points, view_dependent, blocks;
  uint8_t position_format, coefficient_format;
  uint8_t zero[2];
  uint8_t networks_sha256[32];
  float background[3];
  uint8_t more_zeros[20];
  SceneFileSpan sections[kSceneFileSections];
};
static_assert(sizeof(SceneFileHead) == 256 && offsetof(SceneFileHead, file_bytes) == 24);
static_assert(sizeof(SceneFileHead) % kSceneFileAlignment == 0);
static_assert(sizeof(SceneBlock) == 308 && offsetof(SceneBlock, constant_middle) == 52,
              "version 1 stores blocks like that");

constexpr uint64_t filled_up(uint64_t bytes) { return round_up<uint64_t>(bytes, kSceneFileAlignment); }

}  // namespace maq
